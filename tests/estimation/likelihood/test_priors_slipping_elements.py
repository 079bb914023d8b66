# SPDX-License-Identifier: MIT
"""Which elements show their friction: those that slip under pressure for long."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.estimation.data.shift_data import MeasuredSignal, ShiftSignals
from drivetwin.estimation.likelihood.priors import (
    SLIPPING,
    find_all_slipping_elements,
    find_slipping_elements,
)
from tests.estimation.synthetic import Run


def _held(signals: ShiftSignals, seconds: float) -> ShiftSignals:
    """The same with the off-going element's pressure held so long after break-away."""
    off = signals.pressures["B2"]
    until = signals.shift.inertia_phase[0] + seconds
    values = np.where(off.time < until, 4e5, 0.0)
    return replace(
        signals, pressures={**signals.pressures, "B2": MeasuredSignal(off.time, values, 7e3)}
    )


def test_the_on_coming_element_alone_where_the_other_vents(stepped: Run) -> None:
    signals, driveline = stepped.signals(), stepped.truth.driveline()
    assert find_slipping_elements(signals, driveline) == ("B3",)
    assert find_slipping_elements(_held(signals, 0.5 * SLIPPING.min_filled), driveline) == ("B3",)


def test_both_where_the_off_going_one_slips_under_pressure(stepped: Run) -> None:
    signals, driveline = stepped.signals(), stepped.truth.driveline()
    slow = _held(signals, 2.0 * SLIPPING.min_filled)
    assert find_slipping_elements(slow, driveline) == ("B3", "B2")
    assert find_all_slipping_elements([signals, slow], [driveline, driveline]) == ("B3", "B2")


def test_noise_about_the_fill_pressure_does_not_make_an_element_slip_under_load(
    stepped: Run,
) -> None:
    """Single samples, some in a thousand, rise far enough over the whole of it."""
    signals, driveline = stepped.signals(), stepped.truth.driveline()
    off, sigma = signals.pressures["B2"], 7e3
    noise = sigma * np.random.default_rng(0).standard_normal(off.time.size)
    near = driveline.offgoing.P0.value + 2.0 * sigma + noise
    values = np.where(
        off.time < signals.shift.inertia_phase[0] + 3.0 * SLIPPING.min_filled, near, 0.0
    )
    pressures = {**signals.pressures, "B2": MeasuredSignal(off.time, values, sigma)}
    assert find_slipping_elements(replace(signals, pressures=pressures), driveline) == ("B3",)
