# SPDX-License-Identifier: MIT
"""Weighted products of columns beside the unknowns of a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.objective import LikelihoodObjective
from drivetwin.estimation.optimize.objective import NormalEquations, find_acting, place_columns


@dataclass(frozen=True, eq=False)
class ColumnProducts:
    """Sums over all terms for q columns Z of the outputs, with J and r those of the fit.

    `own` (q, q) is ZᵀΣ⁻¹Z, `cross` (p, q) JᵀΣ⁻¹Z and `pull` (q,) ZᵀΣ⁻¹r; `weighted` (n, q) is
    Σ⁻¹Z of each term. With an amount s (q,) of the effects the residual is r - Z·s, and Q changes
    by sᵀ·own·s - 2·pull·s before the unknowns follow.
    """

    own: FloatArray
    cross: FloatArray
    pull: FloatArray
    weighted: tuple[FloatArray, ...]


def compute_column_products(
    problem: LikelihoodObjective[Any], normal: NormalEquations, columns: Sequence[FloatArray]
) -> ColumnProducts:
    """Compute the products of `columns` (n, q) of each term at the point of `normal`."""
    size = columns[0].shape[1]
    own, cross = np.zeros((size, size)), np.zeros((normal.gradient.size, size))
    pull, every = np.zeros(size), []
    for term, z, residual, regressors in zip(
        problem.terms, columns, normal.residuals, normal.regressors, strict=True
    ):
        # Effects and unknowns of other logs have columns of zeros here.
        acting, moving = find_acting(z), find_acting(regressors)
        seen = z[:, acting]
        answer = term.weighting.apply_inverse(seen)
        own[np.ix_(acting, acting)] += seen.T @ answer
        cross[np.ix_(moving, acting)] += regressors[:, moving].T @ seen
        pull[acting] += answer.T @ residual
        every.append(place_columns(answer, acting, size))
    return ColumnProducts(own, cross, pull, tuple(every))
