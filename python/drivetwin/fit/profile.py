# SPDX-License-Identifier: MIT
"""Unknowns of a fit in which Q rises more slowly than by its expansion, and their profiles.

A clutch that holds for any larger friction bounds it on one side: the expansion at the minimum
promises an interval that the recording does not. Two runs along the direction in which the others
follow an unknown show it, as Q rises there at least as fast as in the profile.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.result.estimate import Z95
from drivetwin.fit.plant import Problem
from drivetwin.likelihood.covariance import invert_information
from drivetwin.likelihood.gauss_newton import OptimizeResult
from drivetwin.likelihood.point import Prior
from drivetwin.likelihood.profile import (
    PROFILE,
    HeldParameter,
    Profile,
    trace_profile,
)


@dataclass(frozen=True)
class RiseSettings:
    """Settings of the test of the rise of Q."""

    distance: float = 2.0
    """Distance of the runs from the minimum, about the end of a 95 % interval [standard
    deviations]."""
    slow: float = 0.826
    """Rise of Q over that of its expansion below which an interval is by profile [ratio]: its end
    is then 10 % farther out, which costs 1 % of the coverage."""


RISE = RiseSettings()


def hold_coordinate(
    minimum: OptimizeResult[Problem], covariance: FloatArray, place: int
) -> HeldParameter:
    """Hold a coordinate of a minimum, by its `place`, with the `covariance` (p, p) of all."""
    point, variance = minimum.point, float(covariance[place, place])
    inverse = invert_information(minimum.normal.information)
    gradient = np.zeros(len(point.names))
    gradient[place] = 1.0
    return HeldParameter(
        point.names[place],
        minimum.problem,
        point,
        minimum.normal.cost,
        float(point.values[place]),
        float(np.sqrt(variance)),
        variance / float(inverse[place, place]),
        lambda other: float(other.values[place]),
        lambda _: gradient,
    )


def trace_slow(
    minimum: OptimizeResult[Problem], covariance: FloatArray, count: int
) -> dict[int, Profile]:
    """Trace the profiles of those of the first `count` coordinates along which Q rises slowly.

    Parameters
    ----------
    minimum
        Minimum with the expansion of Q.
    covariance
        Covariance (p, p) of the coordinates.
    count
        Number of the coordinates that are tested.

    Returns
    -------
    dict
        Profile by the place of the coordinate.
    """
    inverse = invert_information(minimum.normal.information)
    found = {}
    for place in range(count):
        step = RISE.distance * inverse[:, place] / np.sqrt(inverse[place, place])
        if any(_is_slow(minimum, side * step) for side in (-1.0, 1.0)):
            found[place] = trace_profile(hold_coordinate(minimum, covariance, place))
    return found


def _is_slow(minimum: OptimizeResult[Problem], step: FloatArray) -> bool:
    """Return whether Q rises slowly over a step (p,) of some standard deviations.

    A step beyond bounds, or beyond the reach of an expansion, is not tried.
    """
    problem, values = minimum.problem, minimum.point.values + step
    inside = (values >= problem.lower) & (values <= problem.upper) & (abs(step) <= problem.reach)
    if not np.all(inside):  # False for steps that are no numbers as well
        return False
    rise = problem.cost(minimum.point.replace_values(values)) - minimum.normal.cost
    return bool(rise < RISE.slow * RISE.distance**2)


def widen(
    covariance: FloatArray, profiles: Mapping[int, Profile], prior: Prior
) -> tuple[FloatArray, dict[int, tuple[float, float]]]:
    """Widen a covariance (p, p) to the 95 % intervals of profiles, by place, which are returned
    beside it.

    An end that a profile does not reach is that of the `prior`; without prior it is the largest
    distance that a profile covers.
    """
    factors, ends = np.ones(len(covariance)), {}
    for place, one in profiles.items():
        std = float(np.sqrt(covariance[place, place]))
        precision = prior.precision[place, place]
        half = Z95 / np.sqrt(precision) if precision > 0.0 else 0.0
        middle = prior.mean[place] if precision > 0.0 else one.estimate
        least = min(one.estimate - PROFILE.max_reach * std, middle - half)
        most = max(one.estimate + PROFILE.max_reach * std, middle + half)
        low, high = np.clip(one.interval, least, most).tolist()
        farthest = max(one.estimate - low, high - one.estimate)
        factors[place] = max(1.0, farthest / (Z95 * std))
        ends[place] = low, high
    return covariance * np.outer(factors, factors), ends
