# SPDX-License-Identifier: MIT
"""Growth of the load with the square of the speed.

Every vehicle meets air drag, a load on a dynamometer none. Left out where it is not significant it
still moves J3 and T_v/i_f, in a short log by several of the standard deviations that the model
without it tells. So there the values are the average over both models, weighted by their likelihood
(Burnham and Anderson 2002), to first order.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import truncnorm

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.fit import LikelihoodFit, compute_covariance
from drivetwin.estimation.likelihood.objective import LikelihoodObjective
from drivetwin.estimation.likelihood.selection.per_shift_load import fit_common_load
from drivetwin.estimation.linear.load_balance import AERO, SIGNIFICANT
from drivetwin.estimation.optimize.gauss_newton import solve_step
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.estimation.result.estimate_set import report_growth
from drivetwin.findings import Finding


def is_significant(point: ParameterVector, covariance: FloatArray) -> bool:
    """Return whether the growing part of the load is significant against its noise."""
    k = point.names.index(AERO)
    return bool(point[AERO] > SIGNIFICANT * np.sqrt(covariance[k, k]))


def report_aero_load(best: LikelihoodFit) -> list[Finding]:
    """Report a load that grows with speed; empty if it does not."""
    if AERO not in best.point.names:
        return []
    k = best.point.names.index(AERO)
    std = float(np.sqrt(best.covariance[k, k]))
    return [report_growth(best.point[AERO], std, best.problem.parts[0].structure.mean_speed)]


def average_with_boundary_model(best: LikelihoodFit, wider: LikelihoodFit) -> LikelihoodFit:
    """The fit without the growing part as the average with the `wider` one, which has it.

    The unknowns follow the growing part along its covariances with them. Of that, which is none or
    above none, mean and variance are those of both models together: each counts by its likelihood,
    the wider with a normal distribution cut at none.
    """
    point, covariance = _beyond_bound(wider)
    k = point.names.index(AERO)
    std = float(np.sqrt(covariance[k, k]))
    mean, variance = _moments(point[AERO] / std)
    follows = {n: covariance[i, k] / std for i, n in enumerate(point.names)}
    along = np.array([follows.get(name, 0.0) for name in best.point.names])
    lower, upper = best.problem.lower, best.problem.upper
    values = np.clip(best.mean.values + mean * along, lower, upper)
    spread = best.covariance + variance * np.outer(along, along)
    return replace(best, mean=best.mean.replace_values(values), covariance=spread)


def _beyond_bound(wider: LikelihoodFit) -> tuple[ParameterVector, FloatArray]:
    """Unknowns and covariance of the wider fit, with one load, if the growing part might be below
    none: where it ends at that bound, the minimum that is expected beyond it."""
    if wider.point[AERO] == 0.0:
        step = solve_step(wider.normal.information, wider.normal.gradient)
        wider = replace(wider, point=wider.point.replace_values(wider.point.values + step))
    return fit_common_load(wider) or (wider.point, wider.covariance)


def _moments(size: float) -> tuple[float, float]:
    """Mean and variance of a quantity that is none or positive, seen as `size`, all in its standard
    deviations."""
    above = truncnorm(-size, np.inf, loc=size)
    weight = 1.0 / (1.0 + np.exp(-0.5 * max(size, 0.0) ** 2))
    mean = weight * above.mean()
    return float(mean), float(weight * above.moment(2) - mean**2)


def drop_growth(best: LikelihoodFit, narrower: LikelihoodObjective) -> LikelihoodFit:
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
