# SPDX-License-Identifier: MIT
"""Maximum likelihood: from start values to the minimum of Q with input noise in the covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.errors import IdentificationError
from drivetwin.identify.likelihood.newton import minimise
from drivetwin.identify.likelihood.output_error import staged
from drivetwin.identify.likelihood.problem import Normal, Problem
from drivetwin.identify.likelihood.unknowns import Point
from drivetwin.identify.signals import FloatArray
from drivetwin.shifts.shift import Shift

PLAUSIBLE = 2.0
"""Q per sample above which a minimum is taken for a wrong one."""


@dataclass(frozen=True)
class LikelihoodFit:
    """The minimum of Q: `point` with `covariance` (p, p), both of the unknowns of the fit.

    `chi2` is Q per sample less the prior; `problem` holds the weighting at the minimum and `normal`
    the expansion of Q there. The covariance is widened where chi2 exceeds 1.
    """

    problem: Problem
    point: Point
    covariance: FloatArray
    normal: Normal
    chi2: float
    iterations: int


def fit(problem: Problem, start: Point, shifts: Sequence[Shift]) -> LikelihoodFit:
    """Fit from `start`, by stages where the direct way does not lead to a plausible minimum.

    Raises IdentificationError where neither does.
    """
    found = _likelihood(problem, start)
    if found is None:
        near = staged(problem, start, shifts)
        found = None if near is None else _likelihood(problem, near.point)
    if found is None:
        raise IdentificationError(
            "the simulation could not be brought onto the measurement",
            "check ratios, clutch gains and P0 on the card against the log, or use the integral "
            "method",
        )
    return found


def _likelihood(problem: Problem, start: Point) -> LikelihoodFit | None:
    """Minimum of Q with input noise; weighting and expected inputs follow the point."""

    def refresh(present: Problem, point: Point) -> Problem:
        if present is problem:
            return problem.weighted_by(point)
        return present.with_expected_inputs(point, problem).weighted_by(point)

    found = minimise(problem, start, refresh)
    if found is None or not found.converged:
        return None
    chi2 = (found.normal.cost - problem.prior.cost(found.point.values)) / problem.size
    if chi2 > PLAUSIBLE:
        return None
    covariance = max(chi2, 1.0) * covariance_of(found.normal.information)
    return LikelihoodFit(
        found.problem, found.point, covariance, found.normal, chi2, found.iterations
    )


def covariance_of(matrix: FloatArray) -> FloatArray:
    """Inverse of an information matrix (p, p), formed after scaling to a unit diagonal."""
    scale = np.sqrt(np.diag(matrix))
    inverse = np.linalg.pinv(matrix / np.outer(scale, scale), rcond=1e-14, hermitian=True)
    return np.asarray(inverse / np.outer(scale, scale))
