# SPDX-License-Identifier: MIT
"""Profile likelihood of one parameter: all others are fitted while it is held."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import notify_progress
from drivetwin.likelihood.gauss_newton import minimise, minimise_constrained
from drivetwin.likelihood.objective import LikelihoodObjective
from drivetwin.likelihood.point import ParameterVector
from drivetwin.vehicle.spec import Z95


@dataclass(frozen=True)
class ProfileSettings:
    """Settings of the profile likelihood."""

    min_reach: float = 3.0
    """Distance to either side that is always covered, in standard deviations [-]."""
    spacing: float = 0.5
    """Distance of neighbouring values, in standard deviations [-]."""
    max_reach: float = 10.0
    """Distance at which the search on an open side stops, in standard deviations [-]."""
    rise: float = 3.841
    """Rise of Q at the ends of a 95 % interval: chi-squared of one degree of freedom [-]."""
    tolerance: float = 1e-3
    """Largest error of the fixed parameter, in standard deviations [-]."""


PROFILE = ProfileSettings()


@dataclass(frozen=True, eq=False)
class Profile:
    """`rise` (n,) of Q, over the noise found in the log, slow errors counted, at `values` (n,) of a
    parameter, SI.

    `interval` is the 95 % interval by the profile, an end infinite where Q does not rise enough;
    `linear` the one by the covariance, from noise alone like the other.
    """

    parameter: str
    values: FloatArray
    rise: FloatArray
    estimate: float
    interval: tuple[float, float]
    linear: tuple[float, float]


@dataclass(frozen=True, eq=False)
class HeldParameter:
    """Parameter of a minimum that is to be held at other values.

    `problem` has the weighting at the minimum `point`, where Q is `cost`. `estimate` and `std` are
    the value there and its standard deviation by the covariance; `unit` is the rise of Q that
    counts as one. `compute_value` and `compute_gradient` (p,) are functions of the unknowns.
    """

    parameter: str
    problem: LikelihoodObjective[Any]
    point: ParameterVector
    cost: float
    estimate: float
    std: float
    unit: float
    compute_value: Callable[[ParameterVector], float]
    compute_gradient: Callable[[ParameterVector], FloatArray]


def trace_profile(held: HeldParameter) -> Profile:
    """Compute the profile of a parameter by minimising over all others while it is held."""
    notify_progress(0.0)
    below = _trace_side(held, -1.0)
    notify_progress(0.5)
    above = _trace_side(held, 1.0)
    sides = np.array([*below[::-1], (0.0, 0.0), *above], dtype=np.float64)
    distance, rise = sides[:, 0], sides[:, 1]
    values = held.estimate + held.std * distance
    ends = (_find_crossing(values[::-1], rise[::-1]), _find_crossing(values, rise))
    half = Z95 * held.std
    linear = (held.estimate - half, held.estimate + half)
    return Profile(held.parameter, values, rise, held.estimate, ends, linear)


def _trace_side(held: HeldParameter, sign: float) -> list[tuple[float, float]]:
    """Compute (distance in standard deviations, rise of Q) from the minimum outwards."""
    lowest, unit = held.cost, held.unit
    estimate, std, point = held.estimate, held.std, held.point
    found: list[tuple[float, float]] = []
    distance = 0.0
    while distance < PROFILE.max_reach and (
        distance < PROFILE.min_reach or found[-1][1] < PROFILE.rise
    ):
        distance += PROFILE.spacing
        value = estimate + sign * distance * std
        reached = _minimise_at(held, point, value)
        if reached is None:
            break
        point, cost = reached
        found.append((sign * distance, (cost - lowest) / unit))
    return found


def _minimise_at(
    held: HeldParameter, start: ParameterVector, value: float
) -> tuple[ParameterVector, float] | None:
    """Minimise Q with the parameter fixed at `value`; None if the simulation fails.

    If the parameter is itself an unknown of the fit, the damped search goes on from the constrained
    one, which may stop early at a kink of Q.
    """
    problem = held.problem
    reached = minimise_constrained(
        problem,
        start,
        lambda point: value - held.compute_value(point),
        held.compute_gradient,
        PROFILE.tolerance * held.std,
    )
    if reached is None or held.parameter not in held.point.names:
        return reached
    place = held.point.names.index(held.parameter)
    prior = problem.prior.fix_parameter(place, value)
    found = minimise(replace(problem, prior=prior), reached[0])
    if found is None:
        return reached
    point = found.point
    cost = (
        found.normal.cost
        - prior.compute_prior_cost(point.values)
        + problem.prior.compute_prior_cost(point.values)
    )
    return (point, cost) if cost < reached[1] else reached


def _find_crossing(values: FloatArray, rise: FloatArray) -> float:
    """Find the value at which the rise passes `PROFILE.rise` outwards; infinite if it does not."""
    outwards = float(np.sign(float(values[-1]) - float(values[0])))
    start = int(np.argmin(np.abs(rise)))
    for k in range(start, values.size - 1):
        if rise[k] < PROFILE.rise <= rise[k + 1]:
            share = (np.sqrt(PROFILE.rise) - np.sqrt(max(rise[k], 0.0))) / (
                np.sqrt(rise[k + 1]) - np.sqrt(max(rise[k], 0.0))
            )
            return float(values[k] + share * (values[k + 1] - values[k]))
    return outwards * float("inf")
