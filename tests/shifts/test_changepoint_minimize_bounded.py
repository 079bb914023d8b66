# SPDX-License-Identifier: MIT
"""Bounded minimum: as SciPy's implementation of the same method, and at known minima."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from drivetwin.shifts.changepoint import minimize_bounded


@settings(derandomize=True)
@given(
    centre=st.floats(-2.0, 2.0),
    power=st.sampled_from([1.0, 1.5, 2.0, 4.0]),
    ripple=st.floats(0.0, 0.5),
    width=st.floats(1e-3, 3.0),
)
def test_takes_the_steps_of_scipy(centre: float, power: float, ripple: float, width: float) -> None:
    def function(x: float) -> float:
        return math.pow(abs(x - centre), power) + ripple * math.sin(5.0 * x)

    bounds = (centre - width, centre + 0.7 * width)
    found = minimize_bounded(function, bounds, 1e-5)
    expected = minimize_scalar(function, bounds=bounds, method="bounded").x
    assert found == pytest.approx(float(expected), abs=1e-12)


def test_ends_at_a_bound_of_a_monotone_function() -> None:
    assert minimize_bounded(lambda x: x, (1.0, 2.0), 1e-6) == pytest.approx(1.0, abs=1e-5)
    assert minimize_bounded(lambda x: -x, (1.0, 2.0), 1e-6) == pytest.approx(2.0, abs=1e-5)
    assert math.isfinite(minimize_bounded(lambda _: 1.0, (0.0, 1.0), 1e-6))
