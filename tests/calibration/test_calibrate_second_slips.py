# SPDX-License-Identifier: MIT
"""Polish with the units that slip again."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetwin.calibration.calibrate import Exchange
from drivetwin.calibration.metrics import Metric, Outcome
from drivetwin.calibration.objective import Objective
from tests.support.arrays import FloatArray

NEEDED = np.array([0.1, 0.2, 0.4, 0.8])
"""Pressure that each of four units needs to hold its lock-up."""
OBJECTIVE = Objective((), 0.5, 100.0)


def assess(at: FloatArray) -> Outcome:
    """Jerk grows with the pressure; a unit slips again below the pressure that it needs."""
    jerk = np.full(NEEDED.size, 10.0 * at[0])
    no = np.zeros(NEEDED.size, np.bool_)
    return Outcome({Metric.PEAK_JERK: jerk}, np.zeros((NEEDED.size, 3)), no, at[0] < NEEDED)


def improve(_: FloatArray, joined: NDArray[np.bool_]) -> FloatArray:
    """Return the least pressure at which the joined units hold."""
    return np.array([NEEDED[joined].max(initial=0.0)])


def test_units_join_until_none_slips_again() -> None:
    held = Exchange(assess, improve, rounds=3).hold_lockup(np.array([0.3]), OBJECTIVE)
    assert held.coordinates.tolist() == [0.8]
    assert held.joined.tolist() == [False, False, True, True]


def test_a_round_that_gains_nothing_is_dropped() -> None:
    """A polish that cannot hold the units returns the start."""

    def fail(at: FloatArray, _: NDArray[np.bool_]) -> FloatArray:
        return at - 0.15

    held = Exchange(assess, fail, rounds=3).hold_lockup(np.array([0.3]), OBJECTIVE)
    assert held.coordinates.tolist() == [0.3]
    assert not held.joined.any()


def test_without_second_slips_nothing_is_polished() -> None:
    def never(_: FloatArray, __: NDArray[np.bool_]) -> FloatArray:
        raise AssertionError

    held = Exchange(assess, never, rounds=3).hold_lockup(np.array([0.9]), OBJECTIVE)
    assert held.coordinates.tolist() == [0.9]
