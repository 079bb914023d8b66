# SPDX-License-Identifier: MIT
"""Outliers, trends and differences of shift quality."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.shifts.summary import (
    adjust_p_values,
    compare_groups,
    estimate_trend,
    find_outliers,
)

ROSNER = (
    "-0.25 0.68 0.94 1.15 1.20 1.26 1.26 1.34 1.38 1.43 1.49 1.49 1.55 1.56 1.58 1.65 1.69 1.70 "
    "1.76 1.77 1.81 1.91 1.94 1.96 1.99 2.06 2.09 2.10 2.14 2.15 2.23 2.24 2.26 2.35 2.37 2.40 "
    "2.47 2.54 2.62 2.64 2.90 2.92 2.92 2.93 3.21 3.26 3.30 3.59 3.68 4.30 4.64 5.34 5.42 6.01"
)
"""Example of Rosner (1983), also in the NIST/SEMATECH handbook, section 1.3.5.17.3."""


def test_the_published_example_has_three_outliers() -> None:
    """The third test alone exceeds its limit: all three farthest values are outliers."""
    values = np.array([float(one) for one in ROSNER.split()])
    assert [values[index] for index in find_outliers(values)] == [6.01, 5.42, 5.34]


def test_false_alarms_of_all_tests_are_at_their_level() -> None:
    """200 groups of 20 without outlier, trend or difference: 10 alarms expected, 20 is 3.2 sd."""
    generator = np.random.default_rng(5)
    alarms = np.zeros(3, dtype=int)
    for _ in range(200):
        values = np.exp(0.2 * generator.standard_normal(20))
        trend = estimate_trend(np.arange(20.0), values)
        difference = compare_groups(values, np.exp(0.2 * generator.standard_normal(15)))
        assert trend is not None
        assert difference is not None
        alarms += (bool(find_outliers(values)), trend.p < 0.05, difference.p < 0.05)
    assert alarms.max() <= 20
    assert alarms.min() >= 2


def test_the_interval_of_a_difference_covers_it() -> None:
    generator = np.random.default_rng(6)
    inside = 0
    for _ in range(200):
        first, second = generator.normal(1.0, 0.3, 9), generator.normal(1.5, 0.3, 12)
        found = compare_groups(first, second)
        assert found is not None
        inside += found.interval[0] <= 0.5 <= found.interval[1]
    assert inside == pytest.approx(190, abs=10)


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20))
def test_adjusted_p_values_keep_their_order_and_grow(values: list[float]) -> None:
    adjusted = adjust_p_values(values)
    assert all(one >= raw for one, raw in zip(adjusted, values, strict=True))
    assert max(adjusted) <= 1.0
    order = np.argsort(values, kind="stable")
    assert np.all(np.diff(np.array(adjusted)[order]) >= 0.0)
    assert min(adjusted) == pytest.approx(min(1.0, len(values) * min(values)))


@given(
    st.lists(st.floats(-1e3, 1e3), min_size=4, max_size=12),
    st.lists(st.floats(-1e3, 1e3), min_size=4, max_size=12),
)
def test_swapped_groups_give_the_opposite_difference(
    first: list[float], second: list[float]
) -> None:
    there, back = (
        compare_groups(np.array(a), np.array(b)) for a, b in ((first, second), (second, first))
    )
    assert there is not None
    assert back is not None
    assert there.shift == pytest.approx(-back.shift, abs=1e-9)
    assert there.interval == pytest.approx((-back.interval[1], -back.interval[0]), abs=1e-9)
    assert there.p == pytest.approx(back.p)
