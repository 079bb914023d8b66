# SPDX-License-Identifier: MIT
"""Identification of a gearbox with converter from the shifts of its control's log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import IdentificationError
from drivetwin.fit.plant import Problem
from drivetwin.likelihood.gauss_newton import GaussNewtonSettings, OptimizeResult, minimise
from drivetwin.likelihood.point import ParameterVector
from drivetwin.tcu.card import ControllerCard
from drivetwin.tcu.log import ControllerShift
from drivetwin.tcu.problem import (
    FLOOR,
    LOOSE,
    Coordinates,
    RowNoise,
    build_problem,
    estimate_noise,
    estimate_sizes,
    weigh,
)
from drivetwin.tcu.unknowns import Own

_LOOSE = GaussNewtonSettings(rough_max_iter=10, rough_rtol=1e-2)
_SEARCHES = 2
"""Loose searches over the same shifts, of which one that went on falling is the first [count]."""
_TIGHT = GaussNewtonSettings(ftol=0.1, kink_ftol=1.0, max_iter=8)
"""Search near the minimum: a decrease of Q by 0.1 is a third of a standard deviation."""
_ROUNDS = 2
"""Minima between which the weights are estimated anew [count]."""
_STEP_SHARE = 0.7
"""Step of a difference over the paths of inputs [posterior standard deviations]."""
_LEAST_STEP = 0.02
"""Least step of a difference [standard deviations of the prior]."""


@dataclass(frozen=True, eq=False)
class TcuTwin:
    """Plant of a gearbox with converter: the card, and the coordinates `values` (p,) of the shared
    numbers `names` with their `covariance` (p, p); the noise of rows; kinds of shifts fitted;
    `sizes` of the numbers that vary from shift to shift, over their stated deviations."""

    card: ControllerCard
    names: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    noise: RowNoise
    kinds: tuple[str, ...]
    sizes: Mapping[Own, float]


@dataclass(frozen=True, eq=False)
class FittedShifts:
    """Minimum of the likelihood of shifts, its covariance (p, p) and the noise of the rows."""

    card: ControllerCard
    shifts: tuple[ControllerShift, ...]
    problem: Problem
    coordinates: Coordinates
    point: ParameterVector
    covariance: FloatArray
    noise: RowNoise
    sizes: Mapping[Own, float]

    @property
    def twin(self) -> TcuTwin:
        """Plant that predicts other shifts."""
        names = self.coordinates.get_shared()
        places = [self.point.names.index(name) for name in names]
        return TcuTwin(
            self.card,
            tuple(names),
            self.point.values[places],
            self.covariance[np.ix_(places, places)],
            self.noise,
            tuple(dict.fromkeys(one.kind for one in self.shifts)),
            self.sizes,
        )


def fit_shifts(card: ControllerCard, shifts: Sequence[ControllerShift]) -> FittedShifts:
    """Fit the numbers of vehicle and clutches to shifts: loose first, then by the residuals.

    The search starts with the first shift of each kind, in which all shared numbers act. It ends
    with these where they leave more than the intervals include: others would be met no better.

    Raises IdentificationError where the simulation cannot be brought onto the log.
    """
    problem, point, coordinates = build_problem(card, shifts)
    first = {one.kind: k for k, one in reversed(list(enumerate(shifts)))}
    sizes: Mapping[Own, float] = {}
    stages, searches = [list(first.values()), list(range(len(shifts)))], 0
    while stages:
        terms = tuple(problem.terms[k] for k in stages[0])
        start = weigh(replace(problem, terms=terms), LOOSE.shared, point)
        found = _require(minimise(start, point, rough=True, settings=_LOOSE))
        point, noise = found.point, estimate_noise(found.problem, found.point)
        searches += 1
        if max(noise.sigma.values()) <= FLOOR:
            stages, searches = stages[1:], 0
        elif found.converged or searches == _SEARCHES:
            fitted = tuple(shifts[k] for k in stages[0])
            return FittedShifts(
                card, fitted, found.problem, coordinates, point, _invert(found), noise, sizes
            )
    for turn in range(_ROUNDS):
        point = found.point
        noise = estimate_noise(found.problem, point)
        covariance = _invert(found)
        spread = np.sqrt(np.diag(covariance))
        problem = _widen_steps(weigh(found.problem, noise.shared, point), coordinates, spread)
        sizes = estimate_sizes(coordinates, point, covariance) if turn else {}
        problem = replace(problem, prior=coordinates.resize(sizes).prior)
        found = _require(minimise(problem, point, settings=_TIGHT))
    return FittedShifts(
        card, tuple(shifts), found.problem, coordinates, found.point, _invert(found), noise, sizes
    )


def _invert(found: OptimizeResult[Problem]) -> FloatArray:
    """Return the covariance (p, p) at a minimum."""
    return np.asarray(np.linalg.inv(found.normal.information), dtype=np.float64)


def _require(found: OptimizeResult[Problem] | None) -> OptimizeResult[Problem]:
    if found is None:
        raise IdentificationError(
            "the simulation of the shifts fails at the numbers of the card",
            "check ratios, levers, converter map and units of the card against the log",
        )
    return found


def _widen_steps(problem: Problem, coordinates: Coordinates, spread: FloatArray) -> Problem:
    """Take differences over a share of the posterior deviation: below it, an expansion counts kinks
    of the actuators as information."""
    steps = dict(
        zip(
            coordinates.names,
            np.maximum(_STEP_SHARE * spread, _LEAST_STEP * coordinates.spread).tolist(),
            strict=True,
        )
    )
    terms = tuple(replace(one, plant=replace(one.plant, steps=steps)) for one in problem.terms)
    return replace(problem, terms=terms)
