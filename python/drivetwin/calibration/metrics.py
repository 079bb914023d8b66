# SPDX-License-Identifier: MIT
"""Metrics of simulated shifts, each over all runs of a batch; definitions in `METRICS`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum, auto

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfilt

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.maneuver import Maneuver
from drivetwin.shifts.metrics import compute_rates, compute_vibration_doses

LOW_PASS = 20.0
"""Corner frequency [Hz] of the low-passed jerk: above it a seat passes little on."""
_LOCKED = 0.5
"""Slip [rad/s] below which the on-coming element counts as locked at the end of a run."""
_BREAKS_AWAY = 1.0
"""Slip [rad/s] of the off-going element from which the inertia phase has begun."""
_SLIP_TIME = 0.05
"""Time [s] that an unlocked run is later than its end per rad/s of remaining slip."""
_FAILED = 1e6
"""Value of every metric of a run that failed."""


class Metric(StrEnum):
    """A metric of a shift."""

    PEAK_JERK = auto()
    SMOOTH_JERK = auto()
    VIBRATION_DOSE = auto()
    TORQUE_HOLE = auto()
    SHIFT_TIME = auto()
    RESPONSE_TIME = auto()
    FRICTION_ENERGY = auto()
    PEAK_POWER = auto()
    FLARE = auto()
    TIE_UP = auto()


@dataclass(frozen=True)
class MetricSpec:
    """Name for people, SI unit, definition and source of a metric."""

    label: str
    unit: str
    definition: str
    source: str


_OWN = "definition of this program"
METRICS: Mapping[Metric, MetricSpec] = {
    Metric.PEAK_JERK: MetricSpec(
        "peak jerk",
        "m/s^3",
        "Largest magnitude of the rate of the vehicle's acceleration r_w·(i_f·T_o - T_v)/J_v, by "
        "central differences on 1 ms; the load is constant within a shift.",
        "definition of jerk",
    ),
    Metric.SMOOTH_JERK: MetricSpec(
        "peak jerk below 20 Hz",
        "m/s^3",
        "Peak jerk of the acceleration after a causal Butterworth low-pass of order 2 at 20 Hz.",
        _OWN,
    ),
    Metric.VIBRATION_DOSE: MetricSpec(
        "vibration dose value",
        "m/s^1.75",
        "(∫ a^4 dt)^¼ of the acceleration minus that before the request, without frequency "
        "weighting.",
        "ISO 2631-1:1997, section 6.3.2",
    ),
    Metric.TORQUE_HOLE: MetricSpec(
        "torque hole",
        "N*m",
        "Fall of the output torque, in the direction of power, below the lower of its values "
        "before the request and at the end of the run.",
        _OWN,
    ),
    Metric.SHIFT_TIME: MetricSpec(
        "shift time",
        "s",
        "Request to the last lock-up; a run that ends with slip counts to its end and 50 ms more "
        "per rad/s.",
        _OWN,
    ),
    Metric.RESPONSE_TIME: MetricSpec(
        "response time",
        "s",
        "Request to the begin of the inertia phase (slip of the off-going element above 1 rad/s).",
        _OWN,
    ),
    Metric.FRICTION_ENERGY: MetricSpec(
        "friction energy", "J", "∫ |τ·s| dt, of both shift elements together.", "definition of work"
    ),
    Metric.PEAK_POWER: MetricSpec(
        "peak friction power",
        "W",
        "Largest |τ·s| of both shift elements together.",
        "definition of power",
    ),
    Metric.FLARE: MetricSpec(
        "flare",
        "rad/s",
        "Largest slip of the off-going element at the engine, away from the new gear.",
        _OWN,
    ),
    Metric.TIE_UP: MetricSpec(
        "tie-up",
        "N*m",
        "Largest torque of the off-going element against the direction of power.",
        _OWN,
    ),
}
"""Definitions of the metrics, in the order of reports."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """Metrics (runs,) of runs with one profile; `jerk` (runs, n) [m/s^3] of the vehicle.

    `unlocked` marks runs that end with slip, `relocked` those whose on-coming element slipped
    again after its first lock-up.
    """

    values: Mapping[Metric, FloatArray]
    jerk: FloatArray
    unlocked: NDArray[np.bool_]
    relocked: NDArray[np.bool_]


def list_outputs(maneuver: Maneuver) -> tuple[str, ...]:
    """Return the outputs of a batch that `compute_metrics` takes, in its order."""
    old, new = maneuver.offgoing.name, maneuver.oncoming.name
    return ("shaft_torque", f"torque.{old}", f"slip.{old}", f"torque.{new}", f"slip.{new}")


def compute_metrics(
    maneuver: Maneuver, columns: FloatArray, last_lock: FloatArray, vehicle: FloatArray
) -> Outcome:
    """Compute the metrics from `columns` (runs, 5, n) in the order of `list_outputs`.

    `last_lock` (runs,) [s] is that of the batch; `vehicle` (runs,) the wheel's inertia J_v
    [kg m^2] of each run.
    """
    failed = ~np.isfinite(columns).all(axis=(1, 2))
    torque, *friction = np.moveaxis(np.nan_to_num(columns), 1, 0)
    off, off_slip, on, on_slip = friction
    time, dt = maneuver.time, maneuver.step
    scale = (maneuver.wheel_radius * maneuver.model.i_f / vehicle)[:, None]
    change = scale * (torque - torque[:, :1])
    jerk = compute_rates(time, change)
    power = np.abs(off * off_slip) + np.abs(on * on_slip)
    unlocked = np.abs(on_slip[:, -1]) > _LOCKED
    values = {
        Metric.PEAK_JERK: np.abs(jerk).max(axis=1),
        Metric.SMOOTH_JERK: _compute_smooth_jerk(change, dt),
        Metric.VIBRATION_DOSE: compute_vibration_doses(time, change),
        Metric.TORQUE_HOLE: _compute_torque_hole(torque),
        Metric.SHIFT_TIME: _compute_shift_time(maneuver, last_lock, on_slip[:, -1]),
        Metric.RESPONSE_TIME: _compute_response_time(maneuver, off_slip),
        Metric.FRICTION_ENERGY: power.sum(axis=1) * dt,
        Metric.PEAK_POWER: power.max(axis=1),
        Metric.FLARE: _compute_flare(maneuver, off_slip),
        Metric.TIE_UP: _compute_tie_up(off),
    }
    for one in values.values():
        one[failed] = _FAILED
    return Outcome(values, jerk, unlocked | failed, _find_relocks(on_slip))


def _compute_smooth_jerk(change: FloatArray, dt: float) -> FloatArray:
    filtered = sosfilt(butter(2, LOW_PASS, fs=1.0 / dt, output="sos"), change, axis=-1)
    return np.asarray(np.abs(np.diff(filtered, axis=-1)).max(axis=1) / dt, dtype=np.float64)


def _compute_torque_hole(torque: FloatArray) -> FloatArray:
    sign = np.sign(torque[:, :1])
    driving = sign * torque
    level = np.minimum(driving[:, 0], driving[:, -1])
    return np.asarray(np.maximum(level - driving.min(axis=1), 0.0))


def _compute_shift_time(
    maneuver: Maneuver, last_lock: FloatArray, end_slip: FloatArray
) -> FloatArray:
    slip = np.abs(end_slip)
    locked = np.isfinite(last_lock) & (slip <= _LOCKED)
    late = maneuver.horizon + _SLIP_TIME * slip
    return np.asarray(np.where(locked, last_lock, late) - maneuver.request)


def _compute_response_time(maneuver: Maneuver, off_slip: FloatArray) -> FloatArray:
    slipping = np.abs(off_slip) > _BREAKS_AWAY
    first = np.where(slipping.any(axis=1), slipping.argmax(axis=1), slipping.shape[1] - 1)
    return np.asarray(maneuver.time[first] - maneuver.request)


def _compute_flare(maneuver: Maneuver, off_slip: FloatArray) -> FloatArray:
    """Slip is ω_e/(i_in·i_c) - i_out·ω_out: its excess at the engine is i_in·i_c times it."""
    lead = maneuver.model.i_in * maneuver.offgoing.i_c * off_slip
    return np.asarray(np.maximum(-maneuver.direction * lead, 0.0).max(axis=1))


def _compute_tie_up(off: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(-np.sign(off[:, :1]) * off, 0.0).max(axis=1))


def _find_relocks(on_slip: FloatArray) -> NDArray[np.bool_]:
    """Find runs that slip more than 0.5 rad/s after they were locked."""
    held = np.abs(on_slip) < 1e-6
    first = np.where(held.any(axis=1), held.argmax(axis=1), on_slip.shape[1])
    after = np.arange(on_slip.shape[1])[None, :] > first[:, None]
    return np.asarray((after & (np.abs(on_slip) > _LOCKED)).any(axis=1))
