# SPDX-License-Identifier: MIT
"""Variation of the load between the shifts of a log, as on hills.

Grade moves the load by hundreds of N m from one minute to the next and no channel tells it. One
load for all shifts would put what it moves into J3 and η; one for each where all are the same would
widen every interval. So each has its own unless they may well be one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin.identify.likelihood.fit import LikelihoodFit
from drivetwin.identify.likelihood.unknowns import DEPARTURE
from drivetwin.identify.load import are_one
from drivetwin.identify.optimize.objective import Point
from drivetwin.identify.signals import FloatArray


def departures_of(loads: Sequence[float]) -> dict[str, float]:
    """Start values of T_v/i_f and of the departures of all shifts of one log with `loads` [N m]."""
    mean = float(np.mean(loads))
    own = {f"start{k}.{DEPARTURE}": load - mean for k, load in enumerate(loads)}
    return {"Tv_over_if": mean, **own}


def with_one_load(fit: LikelihoodFit) -> tuple[Point, FloatArray] | None:
    """The unknowns but the departures, and their covariance, if all loads of a log were one.

    To first order of the minimum. As they are where the fit has no departures; None where the loads
    differ.
    """
    point, covariance = fit.point, fit.covariance
    away = [k for k, name in enumerate(point.names) if name.endswith(f".{DEPARTURE}")]
    rest = [k for k in range(len(point.names)) if k not in away]
    if not away:
        return point, covariance
    own, cross = covariance[np.ix_(away, away)], covariance[np.ix_(rest, away)]
    if not are_one(point.values[away], own):
        return None
    along = np.linalg.solve(own, cross.T).T
    names = tuple(point.names[k] for k in rest)
    values = point.values[rest] - along @ point.values[away]
    return Point(names, values), covariance[np.ix_(rest, rest)] - along @ cross.T


def loads_of(fit: LikelihoodFit) -> tuple[float, ...]:
    """Load of each shift at the output shaft [N m] where they differ; else empty."""
    structures = [part.structure for part in fit.problem.parts]
    if not any(one.departure for one in structures):
        return ()
    return tuple(one.load(fit.mean) for one in structures)
