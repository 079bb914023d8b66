# SPDX-License-Identifier: MIT
"""The integral method over all shifts of a log, and what the sensors' tolerances do to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from drivetwin.identify.conclude import Conclusions, conclude, with_systematic_band
from drivetwin.identify.friction import stribeck_at
from drivetwin.identify.integral import IntegralShift, identify_shift
from drivetwin.identify.load import growing_from
from drivetwin.identify.signals import Driveline, FloatArray, ShiftSignals
from drivetwin.identify.uncertainty import systematic_std
from drivetwin.progress import tell
from drivetwin.vehicle.spec import VehicleCard, middle_of


def integral_method(
    signals: Sequence[ShiftSignals], drivelines: Sequence[Driveline], card: VehicleCard
) -> tuple[Conclusions, tuple[IntegralShift, ...]]:
    """What the noise lets the method conclude, and its stages on each shift.

    Raises IdentificationError where a shift does not carry it.
    """
    start, shifts = middle_of(card.J_prime_range), []
    load_at = growing_from(signals, card.final_drive)
    for k, (s, d) in enumerate(zip(signals, drivelines, strict=True)):
        tell(k / len(signals))
        shifts.append(identify_shift(s, d, start, load_at))
    return conclude(shifts, signals, drivelines, {}), tuple(shifts)


def with_tolerances(
    shifts: Sequence[IntegralShift],
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[Driveline],
    card: VehicleCard,
) -> Conclusions:
    """The conclusions with the card's sensor tolerances counted.

    Each tolerance takes the whole method again on each shift, so this is left to those who show
    the outcome.
    """
    parameters, bands = _systematic(signals, drivelines, shifts, card)
    found = conclude(shifts, signals, drivelines, parameters)
    friction = {
        name: with_systematic_band(curve, bands[name]) if name in bands else curve
        for name, curve in found.friction.items()
    }
    return replace(found, friction=friction)


def _systematic(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[Driveline],
    shifts: Sequence[IntegralShift],
    card: VehicleCard,
) -> tuple[dict[str, float], Mapping[str, FloatArray]]:
    """Standard deviations from the card's sensor tolerances: by parameter id, and of μ by element.

    A sensor's error is the same in all shifts of a log, so several shifts do not average it out:
    the largest counts. Empty where the card states no tolerance.
    """
    parameters: dict[str, float] = {}
    bands: dict[str, FloatArray] = {}
    if not card.sensors:
        return parameters, bands
    start = middle_of(card.J_prime_range)
    for k, (s, d, base) in enumerate(zip(signals, drivelines, shifts, strict=True)):
        tell(k / len(signals))

        def values(x: ShiftSignals, d: Driveline = d, base: IntegralShift = base) -> FloatArray:
            run = identify_shift(x, d, start, base.load.holds_at)
            found = dict(zip(run.ids, run.values, strict=True))
            told = [found.get(k, v) for k, v in zip(base.ids, base.values, strict=True)]
            if base.friction is None:
                return np.array(told)
            fit = base.friction if run.friction is None else run.friction
            return np.append(told, stribeck_at(fit, base.friction.curve.slip))

        std = systematic_std(values, s, card.sensors)
        for name, value in zip(base.ids, std[: len(base.ids)], strict=True):
            parameters[name] = max(parameters.get(name, 0.0), float(value))
        if base.friction is not None:
            bands[base.friction.element] = std[len(base.ids) :]
    return parameters, bands
