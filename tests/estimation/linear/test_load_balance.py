# SPDX-License-Identifier: MIT
"""Load and vehicle inertia where the load grows with the square of the speed, and where not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.estimation.linear.estimates import assess_shifts
from drivetwin.estimation.linear.load_balance import (
    find_growth_reference,
)
from drivetwin.estimation.linear.pipeline import identify_shift
from drivetwin.findings import Code
from tests.estimation.synthetic import Run, Truth

AERO = 30.0
"""N m s^2/rad^2 at the wheel: so much that a shift of some seconds shows it."""


def _grown(signals: ShiftSignals) -> ShiftSignals:
    """The signals as if the load grew with the square of the wheel speed: eq. 11, by hand."""
    wheel, torque = signals.wheel_speed, signals.output_torque
    assert wheel is not None
    mean = float(np.mean(wheel.values))
    speed = np.interp(torque.time, wheel.time, np.convolve(wheel.values, np.ones(5) / 5.0, "same"))
    more = AERO * (np.clip(speed, wheel.values.min(), None) ** 2 - mean**2) / Truth().i_f
    return replace(signals, output_torque=replace(torque, values=torque.values + more))


@pytest.fixture
def signals(stepped: Run) -> ShiftSignals:
    """A noisy shift with throttle steps before it."""
    return stepped.noisy(np.random.default_rng(5))


def test_a_constant_load_does_not_grow(signals: ShiftSignals) -> None:
    assert find_growth_reference([signals], Truth().i_f) is None


def test_the_conclusions_have_the_law_and_an_inertia_that_holds(signals: ShiftSignals) -> None:
    grown, driveline = _grown(signals), Truth().driveline()
    holds_at = find_growth_reference([grown], driveline.i_f)
    shift = identify_shift(grown, driveline, 12.0, holds_at)
    told = assess_shifts([shift], [grown], [driveline], {})
    assert told.load is not None
    assert told.load.mean_speed == holds_at
    assert abs(told.load.aero - AERO) < 4.0 * told.load.std
    J = told.estimates["J_vehicle"]
    assert J.value is not None
    assert J.std_noise is not None
    assert abs(J.value - Truth().J_vehicle) < 4.0 * J.std_noise
    assert "aero" not in told.correlation_ids
    assert Code.LOAD_GROWS in [one.code for one in told.findings]
