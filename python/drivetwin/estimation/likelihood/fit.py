# SPDX-License-Identifier: MIT
"""Ratio of residual power to sensor noise."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.parametrization import DualClutchProblem
from drivetwin.likelihood.budget import limit_evaluations
from drivetwin.likelihood.covariance import compute_covariance, invert_information
from drivetwin.likelihood.point import NormalEquations, ParameterVector
from drivetwin.vehicle.effects import EffectId


@dataclass(frozen=True, eq=False)
class PlantEvidence:
    """Evidence of the element that the plant of a fit has beside the dual clutch.

    `nats` is the log evidence against the dual clutch alone, `moves` (p,) are those of the unknowns
    from its minimum, `index` is that of the logarithm of the size among them.
    """

    effect: EffectId
    nats: float
    moves: FloatArray
    index: int


@dataclass(frozen=True, eq=False)
class LikelihoodFit:
    """Minimum of Q at `point` with the estimate of the unknowns: `mean`, `covariance` (p, p).

    `mean` is the minimum, or the average over minima of similar likelihood (sampling_mode.py).
    `chi2` is Q per sample less the prior; `problem` holds the weighting at the minimum and `normal`
    the expansion of Q there. The covariance is that of `compute_covariance`. `plant` describes the
    element beside the dual clutch; its unknowns come last, that of the size first.
    """

    problem: DualClutchProblem
    point: ParameterVector
    mean: ParameterVector
    covariance: FloatArray
    normal: NormalEquations
    chi2: float
    iterations: int
    plant: PlantEvidence | None = None

    @cached_property
    def deviance(self) -> float:
        """Q + log|Σ|: -2 log of likelihood times prior, up to a constant of the samples.

        Σ is computed anew at the minimum: that of the search is of the point before, where noise
        about P0 opened an element at other instants, and log|Σ| was another by up to a thousand.
        It is no part of a search and counts as no work.
        """
        with limit_evaluations(np.inf):
            anew = self.problem.update_weighting(self.point)
            return anew.cost(self.point) + anew.log_determinant

    @cached_property
    def noise_covariance(self) -> FloatArray:
        """Covariance (p, p) of the unknowns from noise and slow errors."""
        return compute_covariance(self.problem, self.normal, self.chi2)


def compute_variance_inflation(fit: LikelihoodFit, rows: FloatArray) -> float:
    """Compute the ratio of residual power, slow errors included, to sensor noise: the mean over
    the independent directions of the unknowns that `rows` (k, p) span."""
    covariance = rows @ invert_information(fit.normal.information) @ rows.T
    spread = rows @ fit.noise_covariance @ rows.T
    scale = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    inverse = np.linalg.pinv(covariance / scale, hermitian=True)
    return float(np.sum(inverse * (spread / scale))) / len(rows)
