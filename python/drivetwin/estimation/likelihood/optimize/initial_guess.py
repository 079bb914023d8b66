# SPDX-License-Identifier: MIT
"""Initial values of the fit: from the linear method if it estimated them, else typical ones.

Without an output torque only ratios over η are identifiable (THEORY section 6). With η = 1 the
model's parameters are these ratios. Their initial values follow from:

    T_e = (Je/η)·ω_e' + (J5/η)·ω_e'/i_g² + (T_v/i_f/η)/i_g     in gear, both gears together
    T_c/η = (T_e - (Je/η)·ω_e')/a                               in the inertia phase
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray, Span
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.segments import MOMENTUM
from drivetwin.estimation.data.shift_data import (
    PLAUSIBLE_ETA,
    DesignData,
    KnownDriveline,
    ShiftSignals,
)
from drivetwin.estimation.likelihood.parametrization import LAW, build_load_deviations
from drivetwin.estimation.linear.friction_points import LOG_V, MU_C, MU_DROP, MU_V
from drivetwin.estimation.linear.load_balance import AERO
from drivetwin.estimation.linear.pipeline import IntegralShift
from drivetwin.estimation.linear.ringdown import estimate_pencil_start
from drivetwin.estimation.paper.wlse import drop_nan_rows
from drivetwin.simulation.dual_clutch import compute_series_inertia
from drivetwin.vehicle.spec import compute_middle

TYPICAL_LAW = {"mu_c": 0.11, "mu_drop": 0.02, "mu_v": 1e-4, "ln_v_s": float(np.log(12.0))}
"""Friction of a wet clutch facing where the log shows none."""
TYPICAL_MODE = (2.0 * np.pi * 10.0, 0.06)
"""Angular frequency [rad/s] and damping ratio of a driveline where no ring-down was clean."""


def _extrapolate_load(shift: IntegralShift, growth: float | None, i_f: float) -> float:
    """Compute T_v/i_f [N m] of a shift under the common growth of the load: it is accurate at
    the shift's own speed, and at the mean speed of the log as inaccurate as the shift's own
    growth."""
    found = shift.load
    if growth is None or found.holds_at is None:
        return found.load
    away = (found.mean_speed**2 - found.holds_at**2) / i_f
    return found.load + (float(found.fit.theta[2]) - growth) * away


def estimate_initial_values(
    shifts: Sequence[IntegralShift], drivelines: Sequence[KnownDriveline]
) -> dict[str, float]:
    """Compute an initial value of every driveline unknown and friction law from the linear fits.

    The median over the shifts is used, because a single shift may be uninformative or wrong.
    """
    combined = {
        name: float(np.median([dict(zip(s.ids, s.values, strict=True))[name] for s in having]))
        for name in dict.fromkeys(name for shift in shifts for name in shift.ids)
        for having in ([shift for shift in shifts if name in shift.ids],)
    }
    found = {
        "eta": combined["eta"],
        "J_e": float(np.median([shift.momentum.get_value("J_e") for shift in shifts])),
        "J_out": combined["J_out"],
        "J_vehicle": combined["J_vehicle"],
        **build_load_deviations(
            [_extrapolate_load(shift, combined.get(AERO), drivelines[0].i_f) for shift in shifts]
        ),
        "te_delay": combined.get("te_delay", shifts[0].momentum.get_value("te_delay")),
    }
    if AERO in combined:
        found[AERO] = combined[AERO]
    if "k_o" in combined:
        found |= {"k_o": combined["k_o"], "c_o": combined["c_o"]}
    else:
        found |= _estimate_typical_shaft(found, drivelines[0])
    return {k: float(v) for k, v in found.items()} | _collect_laws(shifts, drivelines)


def _estimate_typical_shaft(
    found: Mapping[str, float], driveline: KnownDriveline
) -> dict[str, float]:
    omega, zeta = TYPICAL_MODE
    J4 = found["J_e"] * driveline.i_after**2 + found["J_out"]
    J5 = found["J_vehicle"] / driveline.i_f**2
    J = compute_series_inertia(J4, J5)
    return {"k_o": J * omega**2, "c_o": 2.0 * zeta * omega * J}


def _collect_laws(
    shifts: Sequence[IntegralShift], drivelines: Sequence[KnownDriveline]
) -> dict[str, float]:
    """Compute law, P0 and drum of every element; one without a curve takes its partner's.

    Of several curves the one that reaches the largest slip: beyond its slips a law may be anything,
    even below zero.
    """
    found: dict[str, float] = {}
    own: dict[str, dict[str, float]] = {}
    reached: dict[str, float] = {}
    for shift, d in zip(shifts, drivelines, strict=True):
        for e in (d.offgoing, d.oncoming):
            found.setdefault(f"{e.name}.P0", e.P0.value)
        found |= {f"{e.name}.drum": e.drum.value for e in d.couplings.values()}
        name = d.oncoming.name
        if shift.friction is None or shift.friction.curve.slip[-1] <= reached.get(name, 0.0):
            continue
        reached[name] = float(shift.friction.curve.slip[-1])
        theta = shift.friction.fit.theta
        order = (MU_C, MU_DROP, MU_V, LOG_V)
        own[name] = {key: float(theta[i]) for key, i in zip(LAW, order, strict=True)}
        found[f"{name}.P0"] = shift.friction.P0
    laws = dict(own)
    for d in drivelines:
        for e, partner in ((d.oncoming, d.offgoing), (d.offgoing, d.oncoming)):
            laws.setdefault(e.name, own.get(partner.name, TYPICAL_LAW))
    for name, law in laws.items():
        found |= {f"{name}.{key}": value for key, value in law.items()}
    return found


@dataclass(frozen=True)
class TorqueFreeGuessSettings:
    """Settings of the initial values without an output torque."""

    step: float = 0.1
    """Time over which speeds are differenced: about a period of the driveline oscillation [s]."""
    iterations: int = 3
    """Iterations of the instruments, the slopes expected from the estimate [-]."""
    ringdown: tuple[float, float] = (0.05, 0.8)
    """Start and end, after lock-up, of the stretch in which the shaft oscillation is sought [s]."""


GUESS = TorqueFreeGuessSettings()


def estimate_without_torque(
    signals: ShiftSignals, driveline: KnownDriveline, design: DesignData
) -> dict[str, float]:
    """Compute an initial value of every unknown from speeds and engine torque of one shift.

    With an output torque η is a plausible one, and the ratios stand for what they are ratios of.
    """
    inertia = _estimate_inertias(signals, driveline, design)
    J_e, J_vehicle, load = inertia
    J_out = 0.0 if driveline.J_out is None else driveline.J_out.value
    J4, J5 = J_e * driveline.i_after**2 + J_out, J_vehicle / driveline.i_f**2
    J = compute_series_inertia(J4, J5)
    rate, omega = _estimate_mode(signals, driveline)
    found = {
        "eta": PLAUSIBLE_ETA.value if signals.scale_known else 1.0,
        "J_e": J_e,
        "J_out": max(J_out, 0.05 * J_e),
        "J_vehicle": J_vehicle,
        "Tv_over_if": load,
        "te_delay": MOMENTUM.delay_prior.value,
        "k_o": J * (rate**2 + omega**2),
        "c_o": 2.0 * rate * J,
    }
    found |= {f"{one.name}.drum": one.drum.value for one in driveline.couplings.values()}
    law = {**TYPICAL_LAW, "mu_c": _estimate_friction_level(signals, driveline, J_e)}
    for one in (driveline.offgoing, driveline.oncoming):
        found[f"{one.name}.P0"] = one.P0.value
        found |= {f"{one.name}.{key}": value for key, value in law.items()}
    return found


def _estimate_inertias(
    signals: ShiftSignals, driveline: KnownDriveline, design: DesignData
) -> tuple[float, float, float]:
    """Estimate (Je/η, J_v/η, T_v/i_f/η) over both gears.

    The vehicle outweighs the engine side, so Je is taken from the middle of the card's range. Noise
    of the slopes would make the vehicle too light by least squares; the slopes that the torque lets
    expect are their instruments.
    """
    J_e = compute_middle(design.J_prime_range)
    shift, delay = signals.shift, MOMENTUM.delay_prior.value
    spans = ((shift.before, driveline.i_before), (shift.after, driveline.i_after))
    ratios, slopes, torques = [], [], []
    for span, gear in spans:
        time, in_gear = _compute_slopes(signals, span)
        slopes.append(in_gear)
        ratios.append(np.full(in_gear.size, gear))
        torques.append(
            np.array([_compute_mean_torque(signals, t - 0.5 * GUESS.step + delay) for t in time])
        )
    every = (np.concatenate(each) for each in (ratios, slopes, torques))
    ratio, slope, torque = drop_nan_rows(*every)
    target, seen = torque - J_e * slope, np.column_stack([slope / ratio**2, 1.0 / ratio])
    limits = np.array(design.J_vehicle_range) / driveline.i_f**2
    found = np.linalg.lstsq(seen, target, rcond=None)[0]
    for _ in range(GUESS.iterations):
        expected = (torque - found[1] / ratio) / (J_e * ratio**2 + found[0])
        instrument = np.column_stack([expected, 1.0 / ratio])
        found = np.linalg.lstsq(instrument.T @ seen, instrument.T @ target, rcond=None)[0]
        found[0] = np.clip(found[0], *limits)
    return J_e, float(found[0]) * driveline.i_f**2, float(found[1])


def _compute_slopes(signals: ShiftSignals, span: Span) -> tuple[FloatArray, FloatArray]:
    """Compute centres [s] and slopes of the engine speed [rad/s^2] over windows of `step`.

    NaN in gaps; a gear held for less than a window has none.
    """
    edges = np.arange(span[0], span[1], GUESS.step)
    speed = signals.engine_speed
    return 0.5 * (edges[1:] + edges[:-1]), np.diff(speed.interpolate_at_times(edges)) / GUESS.step


def _compute_mean_torque(signals: ShiftSignals, start: float) -> float:
    """Compute the mean engine torque over `GUESS.step` from `start` [s]."""
    time = np.linspace(start, start + GUESS.step, 11)
    return float(np.mean(signals.engine_torque.interpolate_at_times(time)))


def _estimate_mode(signals: ShiftSignals, driveline: KnownDriveline) -> tuple[float, float]:
    """Estimate decay rate [1/s] and angular frequency [rad/s] of the twist rate after lock-up."""
    lockup = signals.shift.lockup_time
    motion = signals.output_speed.select_span(
        (lockup + GUESS.ringdown[0], lockup + GUESS.ringdown[1])
    )
    time, twist_rate = motion.time, motion.values
    if signals.wheel_speed is not None:
        twist_rate = motion.values - driveline.i_f * signals.wheel_speed.interpolate_at_times(
            motion.time
        )
    try:
        time, twist_rate = drop_nan_rows(time, twist_rate)
        trend = np.vander(time - time[0], 3)
        rest = twist_rate - trend @ np.linalg.lstsq(trend, twist_rate, rcond=None)[0]
        return estimate_pencil_start(time, rest)
    except IdentificationError:
        omega, zeta = TYPICAL_MODE
        return zeta * omega, omega


def _estimate_friction_level(signals: ShiftSignals, driveline: KnownDriveline, J_e: float) -> float:
    """Estimate the mean μ/η over the middle half of the inertia phase."""
    start, end = signals.shift.inertia_phase
    low, high = start + 0.25 * (end - start), end - 0.25 * (end - start)
    speed, element = signals.engine_speed, driveline.oncoming
    ends = np.interp([low, high], speed.time, speed.values)
    slope = float(ends[1] - ends[0]) / (high - low)
    time = np.linspace(low, high, 50)
    torque = float(np.mean(signals.engine_torque.interpolate_at_times(time))) - J_e * slope
    above = (
        float(np.mean(signals.pressures[element.name].interpolate_at_times(time)))
        - element.P0.value
    )
    return float(np.clip(abs(torque / element.a) / (element.gain * max(above, 1e3)), 0.02, 0.4))
