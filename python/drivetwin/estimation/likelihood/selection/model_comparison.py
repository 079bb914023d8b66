# SPDX-License-Identifier: MIT
"""Log evidence of one model against another, and the average over models.

With Q and the information F at the minima of both, and s the prior standard deviations of the
unknowns that the wider one adds, Laplace's log evidence for it is

    ln B = ½·(Q - Q′)/max(χ², 1) + ½·(log|F| - log|F′|) - Σ log s
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.optimize.objective import NormalEquations, ParameterVector
from drivetwin.vehicle.spec import PriorValue


class Minimum(Protocol):
    """Minimum of Q: a fit, or the result of a search."""

    @property
    def point(self) -> ParameterVector:
        """Unknowns at the minimum."""

    @property
    def normal(self) -> NormalEquations:
        """Expansion of Q there."""


def compute_evidence(
    plain: Minimum, extended: Minimum, chi2: float, priors: Sequence[PriorValue]
) -> float:
    """Compute the log evidence of an extended model against a plain one.

    Q alone counts: both have the same weighting, or nearly. `chi2` is the residual power per
    sample, `priors` are those of the unknowns that the extended model adds.
    """
    fall = plain.normal.cost - extended.normal.cost
    before, after = (np.linalg.slogdet(one.normal.information)[1] for one in (plain, extended))
    spread = np.sum(np.log([one.std for one in priors]))
    return float(0.5 * fall / max(chi2, 1.0) + 0.5 * (before - after) - spread)


def average_over(fit: LikelihoodFit, others: Iterable[tuple[FloatArray, float]]) -> LikelihoodFit:
    """Widen the covariance of a fit by other models: `moves` (p,) of the unknowns to each, and its
    log odds.

    It grows by the outer products of the moves, times the probabilities of the models.
    """
    covariance = fit.covariance
    for moves, odds in others:
        covariance = covariance + np.exp(-np.logaddexp(0.0, -odds)) * np.outer(moves, moves)
    return replace(fit, covariance=covariance)
