# SPDX-License-Identifier: MIT
"""Identification of a gearbox with converter from the shifts of its control's log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import IdentificationError
from drivetwin.estimation.optimize.gauss_newton import GaussNewtonSettings, OptimizeResult, minimise
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.fit.driven_term import DrivenProblem
from drivetwin.tcu.card import ControllerCard
from drivetwin.tcu.log import ControllerShift
from drivetwin.tcu.problem import (
    LOOSE,
    Coordinates,
    RowNoise,
    build_problem,
    estimate_noise,
    weigh,
)

_LOOSE = GaussNewtonSettings(rough_max_iter=10, rough_rtol=1e-2, bend_ratio=0.75)
_TIGHT = GaussNewtonSettings(ftol=0.1, kink_ftol=1.0, max_iter=8, bend_ratio=0.75)
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
    numbers `names` with their `covariance` (p, p); the noise of rows; kinds of shifts fitted."""

    card: ControllerCard
    names: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    noise: RowNoise
    kinds: tuple[str, ...]

    def get_place(self, name: str) -> int:
        """Return the place of a shared number."""
        return self.names.index(name)


@dataclass(frozen=True, eq=False)
class FittedShifts:
    """Minimum of the likelihood of shifts, its covariance (p, p) and the noise of the rows."""

    card: ControllerCard
    shifts: tuple[ControllerShift, ...]
    problem: DrivenProblem
    coordinates: Coordinates
    point: ParameterVector
    covariance: FloatArray
    noise: RowNoise

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
        )


def fit_shifts(card: ControllerCard, shifts: Sequence[ControllerShift]) -> FittedShifts:
    """Fit the numbers of vehicle and clutches to shifts: loose first, then by the residuals.

    Raises IdentificationError where the simulation cannot be brought onto the log.
    """
    problem, point, coordinates = build_problem(card, shifts)
    problem = weigh(problem, LOOSE, point)
    found = _require(minimise(problem, point, rough=True, settings=_LOOSE))
    noise = LOOSE
    for _ in range(_ROUNDS):
        point = found.point
        noise = estimate_noise(found.problem, point)
        spread = np.sqrt(np.diag(np.linalg.inv(found.normal.information)))
        problem = _widen_steps(weigh(found.problem, noise, point), coordinates, spread)
        found = _require(minimise(problem, point, settings=_TIGHT))
    covariance = np.asarray(np.linalg.inv(found.normal.information), dtype=np.float64)
    return FittedShifts(
        card, tuple(shifts), found.problem, coordinates, found.point, covariance, noise
    )


def _require(found: OptimizeResult[DrivenProblem] | None) -> OptimizeResult[DrivenProblem]:
    if found is None:
        raise IdentificationError(
            "the simulation of the shifts fails at the numbers of the card",
            "check ratios, levers, converter map and units of the card against the log",
        )
    return found


def _widen_steps(
    problem: DrivenProblem, coordinates: Coordinates, spread: FloatArray
) -> DrivenProblem:
    """Take differences over a share of the posterior deviation: below it, an expansion counts kinks
    of the actuators as information."""
    steps = dict(
        zip(
            coordinates.names,
            np.maximum(_STEP_SHARE * spread, _LEAST_STEP * coordinates.spread).tolist(),
            strict=True,
        )
    )
    terms = tuple(
        replace(term, steps={name: steps[name] for name in term.names}) for term in problem.terms
    )
    return replace(problem, terms=terms)
