# SPDX-License-Identifier: MIT
"""The search stays within its bounds, and ends at the best point within them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from drivetwin.identify.likelihood.newton import minimise
from drivetwin.identify.likelihood.problem import Problem
from drivetwin.identify.likelihood.unknowns import Point
from drivetwin.identify.regression import Prior

NAMES = ("a", "b", "c")


@given(
    st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3),
    st.floats(0.0, 0.99),
    st.floats(0.2, 3.0),
)
def test_correlated_unknowns_at_their_bounds(
    mean: list[float], correlation: float, room: float
) -> None:
    precision = np.full((3, 3), correlation) + (1.0 - correlation) * np.eye(3)
    upper = np.full(3, room)
    problem = Problem((), Prior(np.array(mean), 1e4 * precision), -upper, upper)
    found = minimise(problem, Point(NAMES, np.zeros(3)))
    assert found is not None
    assert found.converged
    root = np.linalg.cholesky(precision).T
    best = lsq_linear(root, root @ np.array(mean), (-upper, upper), method="bvls").x
    least = problem.cost(Point(NAMES, best))
    assert problem.cost(found.point) == pytest.approx(least, abs=0.02 * (1.0 + least))
