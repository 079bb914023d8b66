# SPDX-License-Identifier: MIT
"""The search stays within its bounds, and ends at the best point within them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from drivetwin.estimation.likelihood.parametrization import DualClutchProblem
from drivetwin.likelihood.gauss_newton import GAUSS_NEWTON, minimise
from drivetwin.likelihood.point import NormalEquations, ParameterVector, Prior
from tests.support.arrays import FloatArray

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
    problem = DualClutchProblem((), Prior(np.array(mean), 1e4 * precision), -upper, upper)
    found = minimise(problem, ParameterVector(NAMES, np.zeros(3)))
    assert found is not None
    assert found.converged
    root = np.linalg.cholesky(precision).T
    best = lsq_linear(root, root @ np.array(mean), (-upper, upper), method="bvls").x
    least = problem.cost(ParameterVector(NAMES, best))
    assert problem.cost(found.point) == pytest.approx(least, abs=0.02 * (1.0 + least))


@dataclass(frozen=True, eq=False)
class Kinked(DualClutchProblem):
    """Q = h·((x² + y² + z²)/2 + |x + 2y - 1| + |y - z - 1|), with the slopes of the side it is on:
    h is its `height`."""

    height: float = 1.0

    _BENDS: ClassVar[FloatArray] = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, -1.0]])

    def _sides(self, point: ParameterVector) -> FloatArray:
        return self._BENDS @ point.values - 1.0

    def cost(self, point: ParameterVector) -> float:
        """Q at a point."""
        smooth = 0.5 * point.values @ point.values
        return self.height * float(smooth + np.abs(self._sides(point)).sum())

    def normal(self, point: ParameterVector) -> NormalEquations:
        """Half the gradient of the side that the point is on, and the smooth part's curvature."""
        signs = np.where(self._sides(point) >= 0.0, 1.0, -1.0)
        gradient = self.height * (0.5 * point.values + 0.5 * signs @ self._BENDS)
        curvature = self.height * 0.5 * np.eye(3)
        return NormalEquations(self.cost(point), gradient, curvature, curvature, (), ())


@given(st.lists(st.floats(-1.5, 1.5), min_size=3, max_size=3), st.sampled_from([1.0, 300.0]))
def test_a_search_goes_along_kinks_to_their_crossing(start: list[float], height: float) -> None:
    """Also far off, where a step promises much more than `CLOSE`: there it crawls a while.

    From a start on a kink a search ends at once, as not converged: it has the slope of one side.
    """
    free = np.full(3, np.inf)
    problem = Kinked((), Prior(np.zeros(3), np.zeros((3, 3))), -free, free, height)
    sides = Kinked._BENDS @ np.array(start) - 1.0
    assume(bool(np.all(np.abs(sides) > 1e-3)))
    found = minimise(problem, ParameterVector(NAMES, np.array(start)))
    assert found is not None
    assert found.converged
    # On both kinks: x = 1 - 2y, z = y - 1, of which x² + y² + z² is least at y = 1/2.
    best = ParameterVector(NAMES, np.array([0.0, 0.5, -0.5]))
    # What the expansion can still promise where a search ends is what it can be away by.
    assert problem.cost(found.point) == pytest.approx(
        problem.cost(best), abs=GAUSS_NEWTON.kink_ftol
    )


@dataclass(frozen=True, eq=False)
class LedOn(DualClutchProblem):
    """Q = 25·(a - weighted_at - 1)²: reweighted at every point it leads on for ever. log|Σ| is
    least where it was weighted at 2."""

    weighted_at: float = 0.0

    @property
    def log_determinant(self) -> float:
        """log|Σ|."""
        return 10.0 * (self.weighted_at - 2.0) ** 2

    def cost(self, point: ParameterVector) -> float:
        """Q at a point."""
        return float(25.0 * (point["a"] - self.weighted_at - 1.0) ** 2)

    def normal(self, point: ParameterVector) -> NormalEquations:
        """The expansion of Q."""
        curvature = np.array([[25.0]])
        gradient = curvature[0] * (point["a"] - self.weighted_at - 1.0)
        return NormalEquations(self.cost(point), gradient, curvature, curvature, (), ())


def test_a_weighting_that_leads_away_stays_as_it_was_where_that_was_likeliest() -> None:
    free = np.full(1, np.inf)

    def reweight_at(_: DualClutchProblem, point: ParameterVector) -> DualClutchProblem:
        return LedOn((), Prior(np.zeros(1), np.zeros((1, 1))), -free, free, weighted_at=point["a"])

    start = ParameterVector(("a",), np.zeros(1))
    found = minimise(
        reweight_at(DualClutchProblem((), Prior.from_independent(1, {}), -free, free), start),
        start,
        reweight_at,
    )
    assert found is not None
    assert found.converged
    # By Q alone it went on to 40, one step after the other.
    assert found.point["a"] == pytest.approx(3.0, abs=0.1)
