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

from drivetwin.identify.conclude import growth_told
from drivetwin.identify.likelihood.fit import LikelihoodFit, spread_of
from drivetwin.identify.likelihood.hills import with_one_load
from drivetwin.identify.likelihood.problem import Problem
from drivetwin.identify.likelihood.unknowns import AERO
from drivetwin.identify.load import SIGNIFICANT
from drivetwin.identify.optimize.gauss_newton import step_of
from drivetwin.identify.optimize.objective import Point
from drivetwin.identify.signals import FloatArray


def grows(point: Point, covariance: FloatArray) -> bool:
    """Return whether the growing part of the load is significant against its noise."""
    k = point.names.index(AERO)
    return bool(point[AERO] > SIGNIFICANT * np.sqrt(covariance[k, k]))


def told(best: LikelihoodFit) -> list[str]:
    """Describe a load that grows with speed; empty if it does not."""
    if AERO not in best.point.names:
        return []
    k = best.point.names.index(AERO)
    std = float(np.sqrt(best.covariance[k, k]))
    return [growth_told(best.point[AERO], std, best.problem.parts[0].structure.mean_speed)]


def allowed_for(best: LikelihoodFit, wider: LikelihoodFit) -> LikelihoodFit:
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
    return replace(best, mean=best.mean.moved(values), covariance=spread)


def _beyond_bound(wider: LikelihoodFit) -> tuple[Point, FloatArray]:
    """Unknowns and covariance of the wider fit, with one load, if the growing part might be below
    none: where it ends at that bound, the minimum that is expected beyond it."""
    if wider.point[AERO] == 0.0:
        step = step_of(wider.normal.information, wider.normal.gradient)
        wider = replace(wider, point=wider.point.moved(wider.point.values + step))
    return with_one_load(wider) or (wider.point, wider.covariance)


def _moments(size: float) -> tuple[float, float]:
    """Mean and variance of a quantity that is none or positive, seen as `size`, all in its standard
    deviations."""
    above = truncnorm(-size, np.inf, loc=size)
    weight = 1.0 / (1.0 + np.exp(-0.5 * max(size, 0.0) ** 2))
    mean = weight * above.mean()
    return float(mean), float(weight * above.moment(2) - mean**2)


def without(best: LikelihoodFit, narrower: Problem) -> LikelihoodFit:
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
        covariance=spread_of(problem, normal, best.chi2),
        normal=normal,
    )


def _taken_out(point: Point, k: int) -> Point:
    """The point without its unknown number k."""
    return Point((*point.names[:k], *point.names[k + 1 :]), np.delete(point.values, k))


def _without(matrix: FloatArray, k: int) -> FloatArray:
    """A matrix (p, p) without row and column k."""
    return np.delete(np.delete(matrix, k, axis=0), k, axis=1)
