# SPDX-License-Identifier: MIT
"""Variation of the load between the shifts of a log, as on hills.

Grade moves the load by hundreds of N m from one minute to the next and no channel tells it. One
load for all shifts would put what it moves into J3 and η; one for each where all are the same would
widen every interval. So each has its own unless they may well be one.
"""

from __future__ import annotations

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.parametrization import LOAD_DEVIATION
from drivetwin.estimation.linear.load_balance import is_common_load
from drivetwin.estimation.optimize.objective import ParameterVector


def fit_common_load(fit: LikelihoodFit) -> tuple[ParameterVector, FloatArray] | None:
    """The unknowns but the departures, and their covariance, if all loads of a log were one.

    To first order of the minimum. As they are where the fit has no departures; None where the loads
    differ.
    """
    point, covariance = fit.point, fit.covariance
    away = [k for k, name in enumerate(point.names) if name.endswith(f".{LOAD_DEVIATION}")]
    rest = [k for k in range(len(point.names)) if k not in away]
    if not away:
        return point, covariance
    own, cross = covariance[np.ix_(away, away)], covariance[np.ix_(rest, away)]
    if not is_common_load(point.values[away], own):
        return None
    along = np.linalg.solve(own, cross.T).T
    names = tuple(point.names[k] for k in rest)
    values = point.values[rest] - along @ point.values[away]
    return ParameterVector(names, values), covariance[np.ix_(rest, rest)] - along @ cross.T


def collect_loads(fit: LikelihoodFit) -> tuple[float, ...]:
    """Load of each shift at the output shaft [N m] where they differ; else empty."""
    structures = [part.structure for part in fit.problem.parts]
    if not any(one.departure for one in structures):
        return ()
    return tuple(one.compute_load(fit.mean) for one in structures)
