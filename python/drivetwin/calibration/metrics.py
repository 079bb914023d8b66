# SPDX-License-Identifier: MIT
"""Metrics of simulated shifts, each over all runs of a batch; definitions in `METRICS`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum, auto
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfilt

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.maneuver import Maneuver
from drivetwin.shifts.quality import compute_rates, compute_vibration_doses
from drivetwin.simulation.driveline import SHAFT
from drivetwin.simulation.network import Output

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
    TORQUE_REDUCTION = auto()
    TORQUE_RATE = auto()
    PRESSURE_RATE = auto()


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
        "Largest magnitude of the rate of the vehicle's acceleration r_w·(i_f·T_o - T_v)/J_v, "
        "behind a tyre by its torque and the inertia behind it, by central differences on 1 ms; "
        "the load is constant within a shift.",
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
    Metric.TORQUE_REDUCTION: MetricSpec(
        "engine torque intervention",
        "N*m",
        "Largest difference between the engine torque and the driver's demand.",
        _OWN,
    ),
    Metric.TORQUE_RATE: MetricSpec(
        "engine torque rate",
        "N*m/s",
        "Largest magnitude of the rate of the engine torque.",
        _OWN,
    ),
    Metric.PRESSURE_RATE: MetricSpec(
        "pressure rate",
        "Pa/s",
        "Largest magnitude of the rate of a pressure at the clutches.",
        _OWN,
    ),
}
"""Definitions of the metrics, in the order of reports."""
OF_INPUTS = (Metric.TORQUE_REDUCTION, Metric.TORQUE_RATE, Metric.PRESSURE_RATE)
"""Metrics that need the inputs of the driveline."""


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

    def select(self, part: NDArray[np.intp]) -> Outcome:
        """Return the outcome of some runs."""
        values = {name: one[part] for name, one in self.values.items()}
        return Outcome(values, self.jerk[part], self.unlocked[part], self.relocked[part])


def list_outputs(maneuver: Maneuver) -> tuple[Output, ...]:
    """Return the outputs of a batch that `compute_metrics` takes, in its order."""
    outputs: list[Output] = [("shaft_torque", SHAFT)]
    for one in (maneuver.offgoing, maneuver.oncoming):
        outputs += [("friction_torque", one.name), ("slip", one.name)]
    return tuple(dict.fromkeys([*outputs, maneuver.body.drive]))


def compute_acceleration(maneuver: Maneuver, drive: FloatArray, vehicle: FloatArray) -> FloatArray:
    """Compute the change of the vehicle's acceleration [m/s^2] from that before the request.

    `drive` (runs, n) is the output `maneuver.body.drive`, `vehicle` (runs,) the inertia [kg m^2]
    that it drives.
    """
    scale = (maneuver.wheel_radius * maneuver.body.factor / vehicle)[:, None]
    return np.asarray(scale * (drive - drive[:, :1]))


@dataclass(frozen=True, eq=False)
class Runs:
    """Runs with one control: `columns` (runs, outputs, n) as `list_outputs` orders them.

    `last_lock` (runs,) [s] is the time of the last lock-up, NaN without one. `inputs` (runs, 3, n)
    or (1, 3, n) are engine torque [N m], off-going and on-coming pressure [Pa] at the clutches,
    followed by their commands in a closed loop; None where no metric needs them.
    """

    columns: FloatArray
    last_lock: FloatArray
    inputs: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class _Runs:
    """Signals (runs, n) of the runs of a batch, with what several metrics need."""

    maneuver: Maneuver
    torque: FloatArray
    off: FloatArray
    off_slip: FloatArray
    on: FloatArray
    on_slip: FloatArray
    last_lock: FloatArray
    acceleration: FloatArray
    inputs: FloatArray | None

    @cached_property
    def jerk(self) -> FloatArray:
        """Jerk of the vehicle [m/s^3]."""
        return compute_rates(self.maneuver.time, self.acceleration)

    @property
    def driving(self) -> FloatArray:
        """Output torque in the direction of power [N m]."""
        return np.asarray(np.sign(self.torque[:, :1]) * self.torque)

    @cached_property
    def power(self) -> FloatArray:
        """Friction power of both elements [W]."""
        return np.asarray(np.abs(self.off * self.off_slip) + np.abs(self.on * self.on_slip))


def compute_metrics(
    maneuver: Maneuver,
    found: Runs,
    vehicle: FloatArray,
    wanted: Iterable[Metric] = tuple(Metric),
) -> Outcome:
    """Compute the `wanted` metrics of runs; those of inputs only where the runs have them.

    `vehicle` (runs,) is the inertia of `maneuver.body` [kg m^2] in each run. A run that failed has
    1e6 in every metric.
    """
    columns, last_lock = found.columns, found.last_lock
    failed = ~np.isfinite(columns).all(axis=(1, 2))
    signals = np.moveaxis(np.nan_to_num(columns) if failed.any() else columns, 1, 0)
    torque, off, off_slip, on, on_slip, *_ = signals
    drive = signals[list_outputs(maneuver).index(maneuver.body.drive)]
    acceleration = compute_acceleration(maneuver, drive, vehicle)
    seen = (torque, off, off_slip, on, on_slip)
    runs = _Runs(maneuver, *seen, last_lock, acceleration, found.inputs)
    known = (one for one in wanted if found.inputs is not None or one not in OF_INPUTS)
    values = {one: _COMPUTE[one](runs) for one in known}
    for one in values.values():
        one[failed] = _FAILED
    unlocked = np.abs(runs.on_slip[:, -1]) > _LOCKED
    return Outcome(values, runs.jerk, unlocked | failed, _find_relocks(runs.on_slip))


def _compute_smooth_jerk(runs: _Runs) -> FloatArray:
    dt = runs.maneuver.step
    sections = butter(2, LOW_PASS, fs=1.0 / dt, output="sos")
    filtered = sosfilt(sections, runs.acceleration, axis=-1)
    return np.asarray(np.abs(np.diff(filtered, axis=-1)).max(axis=1) / dt, dtype=np.float64)


def _compute_shift_time(runs: _Runs) -> FloatArray:
    slip = np.abs(runs.on_slip[:, -1])
    locked = np.isfinite(runs.last_lock) & (slip <= _LOCKED)
    late = runs.maneuver.horizon + _SLIP_TIME * slip
    return np.asarray(np.where(locked, runs.last_lock, late) - runs.maneuver.request)


def _compute_response_time(runs: _Runs) -> FloatArray:
    slipping = np.abs(runs.off_slip) > _BREAKS_AWAY
    first = np.where(slipping.any(axis=1), slipping.argmax(axis=1), slipping.shape[1] - 1)
    return np.asarray(runs.maneuver.time[first] - runs.maneuver.request)


def _compute_torque_reduction(runs: _Runs) -> FloatArray:
    assert runs.inputs is not None
    demand = runs.maneuver.point.engine_torque
    return _extend(np.abs(runs.inputs[:, 0] - demand).max(axis=-1), runs)


def _compute_input_rate(runs: _Runs, chosen: slice) -> FloatArray:
    assert runs.inputs is not None
    steps = np.abs(np.diff(runs.inputs[:, chosen], axis=-1)).max(axis=(-1, -2))
    return _extend(steps / runs.maneuver.step, runs)


def _extend(values: FloatArray, runs: _Runs) -> FloatArray:
    """Return values (runs,) of those of each run or of all runs alike."""
    return np.array(np.broadcast_to(values, runs.last_lock.shape))


_COMPUTE: Mapping[Metric, Callable[[_Runs], FloatArray]] = {
    Metric.PEAK_JERK: lambda runs: np.abs(runs.jerk).max(axis=1),
    Metric.SMOOTH_JERK: _compute_smooth_jerk,
    Metric.VIBRATION_DOSE: lambda runs: compute_vibration_doses(
        runs.maneuver.time, runs.acceleration
    ),
    Metric.TORQUE_HOLE: lambda runs: np.maximum(
        runs.driving[:, [0, -1]].min(axis=1) - runs.driving.min(axis=1), 0.0
    ),
    Metric.SHIFT_TIME: _compute_shift_time,
    Metric.RESPONSE_TIME: _compute_response_time,
    Metric.FRICTION_ENERGY: lambda runs: runs.power.sum(axis=1) * runs.maneuver.step,
    Metric.PEAK_POWER: lambda runs: runs.power.max(axis=1),
    # Slip is ω_e/(i_in·i_c) - i_out·ω_out: its excess at the engine is i_in·i_c times it.
    Metric.FLARE: lambda runs: np.maximum(
        -runs.maneuver.direction
        * (runs.maneuver.model.i_in * runs.maneuver.offgoing.i_c)
        * runs.off_slip,
        0.0,
    ).max(axis=1),
    Metric.TIE_UP: lambda runs: np.maximum(-np.sign(runs.off[:, :1]) * runs.off, 0.0).max(axis=1),
    Metric.TORQUE_REDUCTION: _compute_torque_reduction,
    Metric.TORQUE_RATE: lambda runs: _compute_input_rate(runs, slice(0, 1)),
    Metric.PRESSURE_RATE: lambda runs: _compute_input_rate(runs, slice(1, 3)),
}
"""Metrics (runs,) of the runs of a batch."""


def _find_relocks(on_slip: FloatArray) -> NDArray[np.bool_]:
    """Find runs that slip more than 0.5 rad/s after they were locked."""
    held = np.abs(on_slip) < 1e-6
    first = np.where(held.any(axis=1), held.argmax(axis=1), on_slip.shape[1])
    after = np.arange(on_slip.shape[1])[None, :] > first[:, None]
    return np.asarray((after & (np.abs(on_slip) > _LOCKED)).any(axis=1))
