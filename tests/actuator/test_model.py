# SPDX-License-Identifier: MIT
"""Actuator model: its parts in their order, and its bounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.actuator.held_signal import HeldSignal
from drivetwin.actuator.model import QUANTITIES, ActuatorModel
from drivetwin.errors import InputError

BAR = 1e5
MODEL = ActuatorModel(0.03, 0.02, 0.03, 1.0, 1.0 * BAR, 0.15, 0.2 * BAR)
STEP = HeldSignal(np.array([0.0, 0.1]), np.array([0.0, 5.0 * BAR]))


def test_nothing_moves_before_the_dead_time() -> None:
    at = np.array([0.0, 0.129, 0.131, 0.2])
    pressure = MODEL.compute_pressure(STEP, at)
    assert pressure[:2].tolist() == [0.0, 0.0]
    assert 0.0 < pressure[2] < pressure[3]


def test_the_pressure_waits_at_the_kiss_pressure_and_ends_below_the_command() -> None:
    full = 0.13 + 0.15 / np.sqrt(4.9 - 1.0)
    pressure = MODEL.compute_pressure(STEP, np.array([full - 1e-4, 2.0]))
    assert pressure[0] == pytest.approx(1.0 * BAR, rel=0.15)
    assert pressure[1] == pytest.approx(4.9 * BAR, rel=1e-6)


def test_the_initial_pressure_counts_as_far_as_the_hysteresis_allows_it() -> None:
    held = HeldSignal(np.array([0.0]), np.array([5.0 * BAR]))
    at = np.array([0.0, 1.0])
    for initial, expected in ((4.95, 4.95), (4.0, 4.9), (9.0, 5.1), (None, 5.0)):
        given = None if initial is None else initial * BAR
        pressure = MODEL.compute_pressure(held, at, given)
        assert pressure / BAR == pytest.approx([expected, expected])


@pytest.mark.parametrize("name", QUANTITIES)
def test_values_outside_their_bounds_are_refused(name: str) -> None:
    with pytest.raises(InputError, match=QUANTITIES[name].label):
        replace(MODEL, **{name: QUANTITIES[name].upper * 1.01})
    with pytest.raises(InputError, match=QUANTITIES[name].label):
        replace(MODEL, **{name: QUANTITIES[name].lower - 0.01})


def test_values_round_trip() -> None:
    assert ActuatorModel.from_values(MODEL.values) == MODEL
