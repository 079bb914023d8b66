# SPDX-License-Identifier: MIT
"""Weighted scalar products of columns beside a fit with residual, slopes and themselves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.shift_objective import ShiftObjective
from drivetwin.estimation.optimize.objective import NormalEquations


@dataclass(frozen=True, eq=False)
class ColumnProducts:
    """Sums over all parts for q columns Z of the outputs, with J and r those of the fit.

    `own` (q, q) is ZᵀΣ⁻¹Z, `cross` (p, q) JᵀΣ⁻¹Z and `pull` (q,) ZᵀΣ⁻¹r; `weighted` (n, q) is
    Σ⁻¹Z of each part. With an amount s (q,) of the effects the residual is r - Z·s, and Q changes
    by sᵀ·own·s - 2·pull·s before the unknowns follow.
    """

    own: FloatArray
    cross: FloatArray
    pull: FloatArray
    weighted: tuple[FloatArray, ...]

    def extend_expansion(
        self, minimum: NormalEquations, precision: FloatArray, known: FloatArray | float = 0.0
    ) -> NormalEquations:
        """The expansion at a `minimum` with the effects as q more unknowns, behind its own.

        Of these `precision` (q,) is known beforehand, about zero, from which they are `known` (q,)
        away already.
        """
        information = np.block(
            [[minimum.information, self.cross], [self.cross.T, self.own + np.diag(precision)]]
        )
        data = np.block([[minimum.data, self.cross], [self.cross.T, self.own]])
        pairs = zip(minimum.regressors, self.weighted, strict=True)
        return replace(
            minimum,
            gradient=np.concatenate([np.zeros(len(self.cross)), precision * known - self.pull]),
            information=information,
            data=data,
            regressors=tuple(np.column_stack(both) for both in pairs),
        )


def compute_column_products(
    problem: ShiftObjective, normal: NormalEquations, columns: Sequence[FloatArray]
) -> ColumnProducts:
    """Form the products of `columns` (n, q) of each part at the point of the expansion `normal`."""
    size = columns[0].shape[1]
    own, cross = np.zeros((size, size)), np.zeros((normal.gradient.size, size))
    pull, every = np.zeros(size), []
    for part, z, residual, regressors in zip(
        problem.parts, columns, normal.residuals, normal.regressors, strict=True
    ):
        weighted = part.weighting.apply_inverse(z)
        own += z.T @ weighted
        cross += regressors.T @ z
        pull += weighted.T @ residual
        every.append(weighted)
    return ColumnProducts(own, cross, pull, tuple(every))
