# SPDX-License-Identifier: MIT
"""The integral method over all shifts of a log, and what the sensors' tolerances do to it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import notify_progress
from drivetwin.channels.pressure_roles import get_pressure_element
from drivetwin.estimation.data.shift_data import (
    DesignData,
    KnownDriveline,
    MeasuredSignal,
    ShiftSignals,
)
from drivetwin.estimation.linear.estimates import assess_shifts
from drivetwin.estimation.linear.friction_points import evaluate_fitted_stribeck
from drivetwin.estimation.linear.load_balance import find_growth_reference
from drivetwin.estimation.linear.pipeline import IntegralShift, identify_shift
from drivetwin.estimation.result.estimate_set import EstimateSet, add_systematic_band
from drivetwin.vehicle.spec import SensorTolerance, compute_middle


def estimate_systematic_std(
    values: Callable[[ShiftSignals], FloatArray],
    signals: ShiftSignals,
    tolerances: Mapping[str, SensorTolerance],
) -> FloatArray:
    """Standard deviation (q,) of `values` from the sensors' errors of gain, offset and age.

    Each tolerance is applied alone; the shifts of the result add in quadrature.
    """
    base = values(signals)
    total = np.zeros_like(base)
    for role, tolerance in tolerances.items():
        for kind, size in asdict(tolerance).items():
            if size:
                error = SensorTolerance(**{kind: size})
                total += (values(apply_sensor_error(signals, role, error)) - base) ** 2
    return np.asarray(np.sqrt(total), dtype=float)


def apply_sensor_error(signals: ShiftSignals, role: str, error: SensorTolerance) -> ShiftSignals:
    """Copy the signals with the gain, offset or delay `error` applied to one sensor."""

    def changed(s: MeasuredSignal) -> MeasuredSignal:
        values = s.values * (1.0 + error.gain) + error.offset
        return replace(s, time=s.time + error.age, values=values)

    name = get_pressure_element(role)
    if name is not None:
        if name not in signals.pressures:
            return signals
        pressures = {**signals.pressures, name: changed(signals.pressures[name])}
        return replace(signals, pressures=pressures)
    match role:
        case "engine_torque":
            return replace(signals, engine_torque=changed(signals.engine_torque))
        case "output_torque":
            return replace(signals, output_torque=changed(signals.output_torque))
        case "engine_speed" | "input_speed":
            return replace(signals, engine_speed=changed(signals.engine_speed))
        case "output_speed":
            return replace(signals, output_speed=changed(signals.output_speed))
        case "wheel_speed" if signals.wheel_speed is not None:
            return replace(signals, wheel_speed=changed(signals.wheel_speed))
        case _:
            return signals


def estimate_integral(
    signals: Sequence[ShiftSignals], drivelines: Sequence[KnownDriveline], design: DesignData
) -> tuple[EstimateSet, tuple[IntegralShift, ...]]:
    """Estimate the parameters by the integral method, with the stages of each shift.

    Raises IdentificationError if a shift does not support the method.
    """
    start, shifts = compute_middle(design.J_prime_range), []
    load_at = find_growth_reference(signals, design.final_drive)
    for k, (s, d) in enumerate(zip(signals, drivelines, strict=True)):
        notify_progress(k / len(signals))
        shifts.append(identify_shift(s, d, start, load_at))
    return assess_shifts(shifts, signals, drivelines, {}), tuple(shifts)


def add_tolerances(
    shifts: Sequence[IntegralShift],
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    design: DesignData,
) -> EstimateSet:
    """The conclusions with the card's sensor tolerances counted.

    Each tolerance takes the whole method again on each shift, so this is left to those who show
    the outcome.
    """
    parameters, bands = _estimate_systematic(signals, drivelines, shifts, design)
    found = assess_shifts(shifts, signals, drivelines, parameters)
    friction = {
        name: add_systematic_band(curve, bands[name]) if name in bands else curve
        for name, curve in found.friction.items()
    }
    return replace(found, friction=friction)


def _estimate_systematic(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    shifts: Sequence[IntegralShift],
    design: DesignData,
) -> tuple[dict[str, float], Mapping[str, FloatArray]]:
    """Standard deviations from the card's sensor tolerances: by parameter id, and of μ by element.

    A sensor's error is the same in all shifts of a log, so several shifts do not average it out:
    the largest counts. Empty where the card states no tolerance.
    """
    parameters: dict[str, float] = {}
    bands: dict[str, FloatArray] = {}
    if not design.sensors:
        return parameters, bands
    start = compute_middle(design.J_prime_range)
    for k, (s, d, base) in enumerate(zip(signals, drivelines, shifts, strict=True)):
        notify_progress(k / len(signals))

        def values(
            x: ShiftSignals, d: KnownDriveline = d, base: IntegralShift = base
        ) -> FloatArray:
            run = identify_shift(x, d, start, base.load.holds_at)
            found = dict(zip(run.ids, run.values, strict=True))
            told = [found.get(k, v) for k, v in zip(base.ids, base.values, strict=True)]
            if base.friction is None:
                return np.array(told)
            fit = base.friction if run.friction is None else run.friction
            return np.append(told, evaluate_fitted_stribeck(fit, base.friction.curve.slip))

        std = estimate_systematic_std(values, s, design.sensors)
        for name, value in zip(base.ids, std[: len(base.ids)], strict=True):
            parameters[name] = max(parameters.get(name, 0.0), float(value))
        if base.friction is not None:
            bands[base.friction.element] = std[len(base.ids) :]
    return parameters, bands
