# SPDX-License-Identifier: MIT
"""Growth of the load with the square of the speed.

Every vehicle meets air drag, a load on a dynamometer none. The growing part is an unknown where it
is significant; where it is not, its effect on the intervals is that of `effects.aero_load`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.fit import LikelihoodFit, compute_covariance
from drivetwin.estimation.likelihood.shift_objective import ShiftObjective
from drivetwin.estimation.linear.load_balance import AERO, LOAD_BALANCE
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.estimation.result.estimate_set import report_growth
from drivetwin.findings import Finding


def is_significant(point: ParameterVector, covariance: FloatArray) -> bool:
    """Return whether the growing part of the load is significant against its noise."""
    k = point.names.index(AERO)
    return bool(point[AERO] > LOAD_BALANCE.significant * np.sqrt(covariance[k, k]))


def report_aero_load(best: LikelihoodFit) -> list[Finding]:
    """Report a load that grows with speed; empty if it does not."""
    if AERO not in best.point.names:
        return []
    k = best.point.names.index(AERO)
    std = float(np.sqrt(best.covariance[k, k]))
    return [report_growth(best.point[AERO], std, best.problem.parts[0].structure.mean_speed)]


def drop_growth(best: LikelihoodFit, narrower: ShiftObjective) -> LikelihoodFit:
    """The fit of the model without the growing part, where that of the wider one ends without any.

    It is the same minimum. What lies on its bound has no place in the covariance: it would widen
    the interval of T_v/i_f, with which it nearly goes, by what it cannot be.
    """
    k = best.point.names.index(AERO)
    point, normal = _taken_out(best.point, k), best.normal
    parts = [
        replace(part, structure=other.structure)
        for part, other in zip(best.problem.parts, narrower.parts, strict=True)
    ]
    normal = replace(
        normal,
        gradient=np.delete(normal.gradient, k),
        information=_without(normal.information, k),
        data=_without(normal.data, k),
        regressors=tuple(np.delete(one, k, axis=1) for one in normal.regressors),
        slopes=tuple(np.delete(one, k, axis=1) for one in normal.slopes),
    )
    problem = replace(narrower, parts=tuple(parts))
    return replace(
        best,
        problem=problem,
        point=point,
        mean=_taken_out(best.mean, k),
        covariance=compute_covariance(problem, normal, best.chi2),
        normal=normal,
    )


def _taken_out(point: ParameterVector, k: int) -> ParameterVector:
    """The point without its unknown number k."""
    return ParameterVector((*point.names[:k], *point.names[k + 1 :]), np.delete(point.values, k))


def _without(matrix: FloatArray, k: int) -> FloatArray:
    """A matrix (p, p) without row and column k."""
    return np.delete(np.delete(matrix, k, axis=0), k, axis=1)
