# SPDX-License-Identifier: MIT
"""Lag of the engine torque beside its delay, against the differential equation of a lag."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lsim

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.data.shift_record import TORQUE
from drivetwin.estimation.likelihood.effects.torque_lag import build
from tests.estimation.likelihood.effects.test_columns import operating_point

LAG = 0.03


def _solve_lag(values: FloatArray, time: FloatArray, lag: float) -> FloatArray:
    """Output of a lag at rest before the first sample."""
    _, found, _ = lsim(([1.0], [lag, 1.0]), values - values[0], time - time[0])
    return np.asarray(found + values[0])


@pytest.mark.parametrize("size", [LAG, -LAG])
def test_the_slower_torque_is_the_lagged_faster_one(size: float) -> None:
    """An acting torque that lags is the lagged logged one; one whose log lags gives back the log.

    Both are without the delay, which is an unknown of its own.
    """
    at = operating_point()
    steady, time = at.record.steady_torque, at.middle
    age = at.part.structure.get_value(at.point, "te_delay")
    fine = np.arange(time[0], time[-1], 2e-4)
    logged = np.interp(fine + age, steady.time, steady.values)
    (found,) = build(at, size)
    change = np.interp(fine, time, found.inputs[TORQUE])
    acting = logged + change
    fast, slow = (logged, acting) if size > 0.0 else (acting, logged)
    expected = np.interp(fine + LAG, fine, _solve_lag(fast, fine, LAG))
    inside = (fine > fine[0] + 10.0 * LAG) & (fine < fine[-1] - 2.0 * LAG)
    largest = np.max(np.abs(change[inside]))
    assert largest > 0.0
    missed = np.sqrt(np.mean((slow - expected)[inside] ** 2))
    assert missed < 0.05 * largest
