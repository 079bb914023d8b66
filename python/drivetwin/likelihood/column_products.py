# SPDX-License-Identifier: MIT
"""Columns beside the unknowns of a fit: weighted products, and the evidence of their amounts.

With F the information of the unknowns and g the gradient of Q/2, the information of the amounts
alone and their pull, the unknowns adjusted, are the Schur complement

    A = ZᵀΣ⁻¹Z - ZᵀΣ⁻¹J·F⁻¹·JᵀΣ⁻¹Z and b = ZᵀΣ⁻¹r + ZᵀΣ⁻¹J·F⁻¹·g

Amounts that are normal about zero with unit variance have the log evidence
½·bᵀ(A + 1)⁻¹b - ½·log|A + 1| against their absence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.likelihood.covariance import invert_information
from drivetwin.likelihood.objective import LikelihoodObjective
from drivetwin.likelihood.point import NormalEquations, find_acting, place_columns


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


@dataclass(frozen=True, eq=False)
class AdjustedColumns:
    """Information `own` (q, q) and `pull` (q,) of amounts, the unknowns adjusted, and the `moves`
    (p, q) of the unknowns by them."""

    own: FloatArray
    pull: FloatArray
    moves: FloatArray


def adjust_unknowns(
    gradient: FloatArray, information: FloatArray, count: int, power: float = 1.0
) -> AdjustedColumns:
    """Adjust the first `count` coordinates to the others, amounts with unit prior.

    `gradient` (p+q,) of Q/2 and `information` (p+q, p+q) are those of all, `power` is that of the
    residual per sample.
    """
    cross = information[:count, count:]
    moves = -invert_information(information[:count, :count]) @ cross
    own = information[count:, count:] - np.eye(cross.shape[1]) + cross.T @ moves
    pull = -(gradient[count:] + moves.T @ gradient[:count])
    return AdjustedColumns(own / power, pull / power, moves)


@dataclass(frozen=True, eq=False)
class WeighedAmounts:
    """Posterior of amounts with unit prior: mean (k,), covariance `spread` (k, k), and log evidence
    `nats` against their absence."""

    nats: float
    amounts: FloatArray
    spread: FloatArray


def weigh_amounts(own: FloatArray, pull: FloatArray) -> WeighedAmounts:
    """Weigh amounts with information `own` (k, k) and `pull` (k,)."""
    matrix = own + np.eye(pull.size)
    spread = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    amounts = spread @ pull
    nats = 0.5 * float(pull @ amounts) - 0.5 * float(np.linalg.slogdet(matrix)[1])
    return WeighedAmounts(nats, amounts, spread)
