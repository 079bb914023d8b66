# SPDX-License-Identifier: MIT
"""Profile likelihood of one parameter: minimum of Q over all others while it is fixed.

    Q_p(v) = min over θ with q(θ) = v of Q(θ)

The interval from Q_p - Q_min = 3.84 needs no linearity, unlike the one from the covariance; where
the two differ, the profile is right. Between neighbouring values the search goes on from the last
point; its steps obey q(θ) = v by a Lagrange multiplier.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import notify_progress
from drivetwin.errors import IdentificationError, InputError
from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.budget import REMEDY
from drivetwin.estimation.likelihood.fit import LikelihoodFit, compute_variance_inflation
from drivetwin.estimation.likelihood.objective import LikelihoodObjective
from drivetwin.estimation.likelihood.uncertainty.derived_parameters import (
    compute_jacobian,
    compute_parameters,
)
from drivetwin.estimation.optimize.gauss_newton import minimise, minimise_constrained
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.estimation.result.estimate import Z95


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


def compute_profile(found: Identification, parameter: str) -> Profile:
    """Compute the profile of a parameter of a likelihood identification.

    Raises InputError for a parameter that the fit does not have or that is known from design, and
    IdentificationError where the identification is by another method.
    """
    fit, signals = get_likelihood_fit(found)
    values = compute_parameters(fit.problem, fit.point, signals)
    if parameter not in values:
        raise InputError(
            f"the fit has no parameter {parameter!r}", f"choose one of {', '.join(values)}"
        )
    held = _hold_reported(fit, signals, list(values).index(parameter), parameter)
    if held.std == 0.0:
        raise InputError(
            f"{parameter} is fixed by design",
            "give it a standard deviation on the vehicle card, or choose another",
        )
    return trace_profile(held)


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


def get_likelihood_fit(found: Identification) -> tuple[LikelihoodFit, Sequence[ShiftSignals]]:
    """Return the fit behind an identification and its signals.

    Raises IdentificationError for another method, or if the likelihood method did not converge.
    """
    fit, gave_up = found.evidence.likelihood, found.evidence.gave_up
    if fit is None and gave_up:
        raise IdentificationError(
            f"the likelihood fit of this log failed, so it has no profile: {gave_up}",
            REMEDY,
        )
    if fit is None:
        raise IdentificationError(
            f"the {found.method} method has no likelihood to work on",
            "identify with --method likelihood",
        )
    return fit, found.evidence.signals


def _hold_reported(
    fit: LikelihoodFit, signals: Sequence[ShiftSignals], place: int, parameter: str
) -> HeldParameter:
    """Hold a reported parameter of a fit, by its place among them and its name."""
    spread = np.sqrt(np.diag(fit.covariance))

    def compute_value(point: ParameterVector) -> float:
        return list(compute_parameters(fit.problem, point, signals).values())[place]

    def compute_gradient(point: ParameterVector) -> FloatArray:
        return np.asarray(compute_jacobian(fit.problem, point, spread, signals)[place])

    row = compute_gradient(fit.point)
    std = float(np.sqrt(max(float(row @ fit.covariance @ row), 0.0)))
    return HeldParameter(
        parameter,
        fit.problem,
        fit.point,
        fit.normal.cost,
        compute_value(fit.point),
        std,
        # Noise that is louder or slower than the sensors' shows the parameter less.
        compute_variance_inflation(fit, row[None, :]) if std > 0.0 else 1.0,
        compute_value,
        compute_gradient,
    )


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
