# SPDX-License-Identifier: MIT
"""Maximum likelihood: from start values to the minimum of Q with input noise in the covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.errors import IdentificationError
from drivetwin.identify.likelihood.newton import Found, minimise
from drivetwin.identify.likelihood.output_error import staged
from drivetwin.identify.likelihood.problem import Problem
from drivetwin.identify.likelihood.unknowns import Point
from drivetwin.identify.signals import FloatArray
from drivetwin.shifts.shift import Shift

PLAUSIBLE = 2.0
"""Q per sample above which a minimum is taken for a wrong one."""


@dataclass(frozen=True)
class LikelihoodFit:
    """The minimum of Q: `point` with `covariance` (p, p), both of the unknowns of the fit.

    `chi2` is Q per sample less the prior; `problem` holds the weighting at the minimum. `data`
    (p, p) is the information of the measurements without the priors.
    """

    problem: Problem
    point: Point
    covariance: FloatArray
    data: FloatArray
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
    """Minimum of Q with input noise, weighted at the start and again where that led."""
    iterations = 0
    point = start
    for _ in range(2):
        weighted = problem.weighted_by(point)
        found = minimise(weighted, point)
        if found is None or not found.converged:
            return None
        point, iterations = found.point, iterations + found.iterations
    chi2 = (found.normal.cost - problem.prior.cost(point.values)) / problem.size
    if chi2 > PLAUSIBLE:
        return None
    return LikelihoodFit(
        weighted, point, covariance_of(found), found.normal.data, chi2, iterations
    )


def covariance_of(found: Found) -> FloatArray:
    """Inverse of the information (p, p), formed after scaling to a unit diagonal."""
    matrix = found.normal.information
    scale = np.sqrt(np.diag(matrix))
    return np.linalg.pinv(matrix / np.outer(scale, scale), rcond=1e-14, hermitian=True) / np.outer(
        scale, scale
    )
