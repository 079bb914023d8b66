# SPDX-License-Identifier: MIT
"""Repair of exceeded limits: tighter bounds and a larger penalty, and what is returned."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.calibration.certificate import LimitCheck
from drivetwin.calibration.keep_limits import Repair, require_limits
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.objective import Limit, Objective
from drivetwin.errors import InfeasibleError, InputError
from tests.support.arrays import FloatArray

LIMITS = (Limit(Metric.SHIFT_TIME, 0.7), Limit(Metric.FRICTION_ENERGY, 4e4))
OBJECTIVE = Objective(LIMITS, 0.9, 100.0)


def measure(at: FloatArray) -> list[float]:
    """Excess of coordinates that are the values themselves, over the bounds."""
    return [float(value / one.bound - 1.0) for value, one in zip(at, LIMITS, strict=True)]


@given(st.floats(0.0, 0.08))
def test_a_polish_that_always_exceeds_its_bounds_is_led_within_them(beyond: float) -> None:
    def improve(_: FloatArray, under: Objective) -> FloatArray:
        return np.array([(1.0 + beyond) * one.bound for one in under.limits])

    start = np.array([(1.0 + beyond) * one.bound for one in LIMITS])
    kept = Repair(measure, improve, 3, 3.0).keep_limits(start, OBJECTIVE)
    assert kept.excess <= 1e-12


def test_bounds_fall_and_the_weight_rises_until_the_limits_hold() -> None:
    seen: list[Objective] = []

    def improve(at: FloatArray, under: Objective) -> FloatArray:
        seen.append(under)
        return np.asarray(at - np.array([0.01, 0.0]))

    start = np.array([0.714, 3e4])
    kept = Repair(measure, improve, 5, 3.0).keep_limits(start, OBJECTIVE)
    assert kept.excess <= 0.0
    assert kept.coordinates == pytest.approx([0.694, 3e4])
    assert [one.weight for one in seen] == [300.0, 900.0]
    assert [one.limits[0].bound for one in seen] == pytest.approx(
        [0.7 / 1.02, 0.7 / 1.02 / (0.704 / 0.7)]
    )
    assert {one.limits[1].bound for one in seen} == {4e4}


def test_the_least_excess_is_returned_where_none_keeps_the_limits() -> None:
    values = iter([0.9, 0.8, 0.95])

    def improve(at: FloatArray, _: Objective) -> FloatArray:
        return np.array([next(values), at[1]])

    kept = Repair(measure, improve, 3, 3.0).keep_limits(np.array([0.85, 3e4]), OBJECTIVE)
    assert kept.coordinates[0] == 0.8
    assert kept.excess == pytest.approx(0.8 / 0.7 - 1.0)


def test_without_limits_nothing_is_polished() -> None:
    kept = Repair(lambda _: [], lambda at, _: at + 1.0, 3, 3.0).keep_limits(
        np.zeros(2), Objective((), 0.9, 1.0)
    )
    assert (kept.coordinates == 0.0).all()


def test_a_limit_that_is_exceeded_is_stated_in_the_unit_of_the_report() -> None:
    limit = Limit(Metric.PEAK_JERK, 10.0)
    found, start = LimitCheck(limit, 12.0, None), LimitCheck(limit, 30.0, None)
    with pytest.raises(InfeasibleError) as caught:
        require_limits((found,), (start,))
    text = caught.value.what + caught.value.remedy
    assert "12 m/s³, limit 10: 2 m/s³ or 20.0 % above it (start: 30 m/s³)" in text
    assert "^" not in text
    with pytest.raises(InputError, match="number in m/s³"):
        Limit(Metric.PEAK_JERK, -1.0)
