# SPDX-License-Identifier: MIT
"""Ratio of residual power to sensor noise."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.budget import at_most
from drivetwin.estimation.likelihood.coloured_noise import beyond_white
from drivetwin.estimation.likelihood.objective import Problem
from drivetwin.estimation.optimize.objective import Normal, Point


@dataclass(frozen=True, eq=False)
class LikelihoodFit:
    """Minimum of Q at `point` with the estimate of the unknowns: `mean`, `covariance` (p, p).

    `mean` is the minimum, or the average over minima that the log hardly distinguishes (kinds.py).
    `chi2` is Q per sample less the prior; `problem` holds the weighting at the minimum and `normal`
    the expansion of Q there. The covariance is that of `spread_of`.
    """

    problem: Problem
    point: Point
    mean: Point
    covariance: FloatArray
    normal: Normal
    chi2: float
    iterations: int

    @cached_property
    def deviance(self) -> float:
        """Q + log|Σ|: -2 log of likelihood times prior, up to a constant of the samples.

        Σ is formed anew at the minimum: that of the search is of the point before, where noise
        about P0 opened an element at other instants, and log|Σ| was another by up to a thousand.
        It is no part of a search and counts as no work.
        """
        with at_most(np.inf):
            anew = self.problem.weighted_by(self.point)
            return anew.cost(self.point) + anew.log_determinant


def spread_of(problem: Problem, normal: Normal, chi2: float) -> FloatArray:
    """Compute the covariance (p, p) at a minimum, widened by residual power beyond sensor noise.

    The whole is widened where `chi2` exceeds 1, and by slow errors where an output shows them, as
    far as the unknowns hang on that output.
    """
    inverse, counted = covariance_of(normal.information), max(chi2, 1.0)
    return counted * inverse + inverse @ beyond_white(problem, normal, counted) @ inverse


def covariance_of(matrix: FloatArray) -> FloatArray:
    """Invert an information matrix (p, p) after scaling to a unit diagonal."""
    scale = np.sqrt(np.diag(matrix))
    inverse = np.linalg.pinv(matrix / np.outer(scale, scale), rcond=1e-14, hermitian=True)
    return np.asarray(inverse / np.outer(scale, scale))


def noise_power(fit: LikelihoodFit, rows: FloatArray) -> float:
    """Compute the ratio of residual power, slow errors included, to sensor noise: the mean over
    the independent directions of the unknowns that `rows` (k, p) span."""
    covariance = rows @ covariance_of(fit.normal.information) @ rows.T
    spread = rows @ spread_of(fit.problem, fit.normal, fit.chi2) @ rows.T
    scale = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    inverse = np.linalg.pinv(covariance / scale, hermitian=True)
    return float(np.sum(inverse * (spread / scale))) / len(rows)
