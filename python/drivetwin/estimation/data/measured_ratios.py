# SPDX-License-Identifier: MIT
"""Ratios of gears and final drive as the speeds of a shift show them, with the card as prior.

A gear is engaged before and after the shift, so that input over output speed is its ratio. The
ratio of the mean speeds is used: the noise of single samples would bias a regression.
"""

from __future__ import annotations

import numpy as np

from drivetwin._util.arrays import Span
from drivetwin.estimation.data.shift_data import (
    KnownDriveline,
    MeasuredSignal,
    ShiftSignals,
)
from drivetwin.parameters import FINAL_DRIVE, make_ratio_id
from drivetwin.vehicle.spec import PriorValue

MIN_SAMPLES = 10
"""Fewest samples of a speed in a gear whose mean is used [count]."""


def measure_ratios(signals: ShiftSignals, driveline: KnownDriveline) -> dict[str, PriorValue]:
    """Measure the ratios of both gears (without the input gear) and of the final drive.

    Returns
    -------
    Ratio by parameter id, its standard deviation from the noise of the speeds; without an entry
    where a speed has too few samples or the vehicle hardly moves.
    """
    shift, driving = signals.shift, signals.engine_speed
    sides = ((driveline.offgoing, shift.before), (driveline.oncoming, shift.after))
    found = {
        make_ratio_id(one.gear): _divide(driving, signals.output_speed, span, 1.0 / one.i_in)
        for one, span in sides
    }
    if signals.wheel_speed is not None:
        whole = (shift.before[0], shift.after[1])
        found[FINAL_DRIVE] = _divide(signals.output_speed, signals.wheel_speed, whole, 1.0)
    return {name: one for name, one in found.items() if one is not None}


def refine_ratios(driveline: KnownDriveline, signals: ShiftSignals) -> KnownDriveline:
    """Return the driveline with the ratios that card and log make likeliest as nominal values.

    Ratios that the card states exactly stay.
    """
    measured, priors = measure_ratios(signals, driveline), driveline.ratio_priors
    values = {name: _combine(priors[name], measured.get(name)) for name in priors}

    return driveline.replace_ratios(values)


def _combine(prior: PriorValue, measured: PriorValue | None) -> float:
    """Return the mean of two normal distributions of one quantity, weighted by their precision."""
    if measured is None or prior.std == 0.0:
        return prior.value
    weight = prior.std**2 / (prior.std**2 + measured.std**2)
    return prior.value + weight * (measured.value - prior.value)


def _divide(
    above: MeasuredSignal, below: MeasuredSignal, span: Span, factor: float
) -> PriorValue | None:
    """Return the ratio of the means of two speeds over `span` [s], times `factor`.

    Both are compared at the stamps of the one with fewer samples.
    """
    first = max(span[0], *(one.time[0] for one in (above, below)))
    last = min(span[1], *(one.time[-1] for one in (above, below)))
    stamps = min(
        (one.select_span((first, last)).time for one in (above, below)), key=lambda time: time.size
    )
    top, bottom = (one.interpolate_at_times(stamps) for one in (above, below))
    use = np.isfinite(top) & np.isfinite(bottom)
    count = np.count_nonzero(use)
    if count < MIN_SAMPLES:
        return None
    mean_top, mean_bottom = float(np.mean(top[use])), float(np.mean(bottom[use]))
    ratio = mean_top / mean_bottom if mean_bottom > 0.0 else 0.0
    if ratio <= 0.0:
        return None
    std = float(np.hypot(above.sigma, ratio * below.sigma)) / (mean_bottom * np.sqrt(count))
    return PriorValue(factor * ratio, factor * std)
