# SPDX-License-Identifier: MIT
"""Initial values of the fit from direct estimates, typical ones where a shift has none.

With an output torque the momentum balance gives η, Je, Jo′ and the delay of the engine torque, and
the balance of the vehicle gives load and J3. Without one only ratios over η are identifiable
(THEORY section 6). With η = 1 the model's parameters are these ratios:

    T_e = (Je/η)·ω_e' + (J5/η)·ω_e'/i_g² + (T_v/i_f/η)/i_g     in gear, both gears together

In both cases the oscillation after lock-up gives the shaft, and the inertia phase the friction
level of the on-coming element:

    T_c = (η·T_e - Je·ω_e')/a
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
from drivetwin.estimation.direct.friction_law import (
    LOG_V,
    MU_C,
    MU_DROP,
    MU_V,
    estimate_friction_law,
)
from drivetwin.estimation.direct.load_balance import drop_nan_rows, estimate_load
from drivetwin.estimation.direct.momentum_balance import estimate_momentum_inertia
from drivetwin.estimation.direct.ringdown import compute_shaft_parameters, estimate_pencil_start
from drivetwin.estimation.likelihood.parametrization import LAW, build_load_deviations
from drivetwin.vehicle.spec import compute_middle

LOAD = "Tv_over_if"
TYPICAL_LAW = {"mu_c": 0.11, "mu_drop": 0.02, "mu_v": 1e-4, "ln_v_s": float(np.log(12.0))}
"""Friction of a wet clutch facing where the log shows none."""
TYPICAL_MODE = (2.0 * np.pi * 10.0, 0.06)
"""Angular frequency [rad/s] and damping ratio of a driveline where no ring-down was clean."""


@dataclass(frozen=True)
class InitialGuessSettings:
    """Settings of the initial values."""

    step: float = 0.1
    """Time over which speeds are differenced: about a period of the driveline oscillation [s]."""
    iterations: int = 3
    """Iterations of the instruments, the slopes expected from the estimate [-]."""
    max_outside: float = 10.0
    """Factor beyond the design ranges of J′ and J3 from which a balance counts as wrong: without a
    wheel speed the swing of a soft shaft hides how little the vehicle changes its speed, and errors
    of a converter's map over the speed ratio look like an inertia [ratio]."""
    max_damping: float = 0.2
    """Largest damping ratio of the shaft, that of a damped propeller shaft: few samples of a short
    oscillation give larger ones [-]."""
    ringdown: tuple[float, float] = (0.05, 0.8)
    """Start and end, after lock-up, of the stretch in which the shaft oscillation is sought [s]."""


GUESS = InitialGuessSettings()


def estimate_initial_values(
    signals: Sequence[ShiftSignals], drivelines: Sequence[KnownDriveline], design: DesignData
) -> dict[str, float]:
    """Compute an initial value of every driveline unknown and friction law.

    The median over the shifts is used, because a single shift may be uninformative or wrong. An
    element that engages in no shift has the friction of its partner.
    """
    shifts = [_estimate_shift(*one, design) for one in zip(signals, drivelines, strict=True)]
    found = {
        name: float(np.median([one[name] for one in shifts if name in one]))
        for name in dict.fromkeys(name for one in shifts for name in one)
    }
    found |= build_load_deviations([one[LOAD] for one in shifts])
    for d in drivelines:
        for one, partner in ((d.oncoming, d.offgoing), (d.offgoing, d.oncoming)):
            law = {key: found.get(f"{partner.name}.{key}", TYPICAL_LAW[key]) for key in LAW}
            found = {f"{one.name}.{key}": value for key, value in law.items()} | found
    return found


def _estimate_shift(
    signals: ShiftSignals, driveline: KnownDriveline, design: DesignData
) -> dict[str, float]:
    """Compute initial values from one shift; the friction is that of the on-coming element."""
    found = _estimate_rigid(signals, driveline, design)
    J4 = found["J_e"] * driveline.i_after**2 + found["J_out"]
    shaft = *_estimate_mode(signals, driveline), J4, found["J_vehicle"] / driveline.i_f**2
    found["k_o"], found["c_o"] = compute_shaft_parameters(*shaft).tolist()
    found |= {f"{one.name}.drum": one.drum.value for one in driveline.couplings.values()}
    found |= {f"{one.name}.P0": one.P0.value for one in (driveline.offgoing, driveline.oncoming)}
    law = _estimate_law(signals, driveline, found)
    return found | {f"{driveline.oncoming.name}.{key}": value for key, value in law.items()}


def _estimate_law(
    signals: ShiftSignals, driveline: KnownDriveline, found: Mapping[str, float]
) -> dict[str, float]:
    """Estimate the law of the on-coming element; without an output torque its level alone."""
    if signals.scale_known:
        try:
            theta = estimate_friction_law(signals, driveline)
            order = (MU_C, MU_DROP, MU_V, LOG_V)
            return {key: float(theta[k]) for key, k in zip(LAW, order, strict=True)}
        except IdentificationError:
            pass
    level = _estimate_friction_level(signals, driveline, found["eta"], found["J_e"])
    return {**TYPICAL_LAW, "mu_c": level}


def _estimate_rigid(
    signals: ShiftSignals, driveline: KnownDriveline, design: DesignData
) -> dict[str, float]:
    """Compute η, inertias, load and delay of the engine torque.

    From speeds and engine torque alone where the log has no output torque, or the shift no
    equation with it. η is then a plausible one, or 1 where all are ratios over it.
    """
    plain = _estimate_without_torque(signals, driveline, design)
    if not signals.scale_known:
        return plain
    try:
        start = compute_middle(design.J_prime_range)
        balance = estimate_momentum_inertia(signals, driveline, MOMENTUM, start)
        names = ("eta", "J_e", "J_out", "te_delay")
        found = {name: balance.get_value(name) for name in names}
        J_prime = found["J_e"] + found["J_out"] / driveline.i_after**2
        if found["J_out"] > 0.0 and _is_plausible(J_prime, design.J_prime_range):
            plain |= found
        load, J_vehicle = estimate_load(signals, driveline.i_f)
    except IdentificationError:
        return plain
    is_plausible = _is_plausible(J_vehicle, design.J_vehicle_range)
    return plain | {LOAD: load, "J_vehicle": J_vehicle} if is_plausible else plain


def _is_plausible(inertia: float, limits: Span) -> bool:
    """Return whether an inertia [kg m^2] is near its design range."""
    return limits[0] / GUESS.max_outside < inertia < limits[1] * GUESS.max_outside


def _estimate_without_torque(
    signals: ShiftSignals, driveline: KnownDriveline, design: DesignData
) -> dict[str, float]:
    """Compute η, inertias, load and delay from speeds and engine torque."""
    J_e, J_vehicle, load = _estimate_inertias(signals, driveline, design)
    J_out = 0.0 if driveline.J_out is None else driveline.J_out.value
    return {
        "eta": PLAUSIBLE_ETA.value if signals.scale_known else 1.0,
        "J_e": J_e,
        "J_out": max(J_out, 0.05 * J_e),
        "J_vehicle": J_vehicle,
        LOAD: load,
        "te_delay": MOMENTUM.delay_prior.value,
    }


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
        decay, omega = estimate_pencil_start(time, rest)
        return min(decay, GUESS.max_damping * omega), omega
    except IdentificationError:
        omega, zeta = TYPICAL_MODE
        return zeta * omega, omega


def _estimate_friction_level(
    signals: ShiftSignals, driveline: KnownDriveline, eta: float, J_e: float
) -> float:
    """Estimate the mean μ over the middle half of the inertia phase."""
    start, end = signals.shift.inertia_phase
    low, high = start + 0.25 * (end - start), end - 0.25 * (end - start)
    speed, element = signals.engine_speed, driveline.oncoming
    ends = np.interp([low, high], speed.time, speed.values)
    slope = float(ends[1] - ends[0]) / (high - low)
    time = np.linspace(low, high, 50)
    torque = eta * float(np.mean(signals.engine_torque.interpolate_at_times(time))) - J_e * slope
    above = (
        float(np.mean(signals.pressures[element.name].interpolate_at_times(time)))
        - element.P0.value
    )
    return float(np.clip(abs(torque / element.a) / (element.gain * max(above, 1e3)), 0.02, 0.4))
