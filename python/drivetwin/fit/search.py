# SPDX-License-Identifier: MIT
"""Search for the minimum of a fit: a screen of draws, then damped Gauss-Newton from the best.

A forward simulation with another order of events has a gradient that knows nothing of the right
one, so a search from one start ends in a wrong minimum in every fifth case. The screen simulates
draws from the priors side by side; only the best are refined.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import scale_progress
from drivetwin.errors import IdentificationError
from drivetwin.estimation.likelihood.budget import BudgetExceeded, limit_evaluations
from drivetwin.estimation.optimize.gauss_newton import (
    GaussNewtonSettings,
    OptimizeResult,
    minimise,
    predict_decrease,
)
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.fit.fixed_numbers import FixedNumber
from drivetwin.fit.omissions import ShownOmission, complete_model
from drivetwin.fit.plant import NetworkTerm, Problem
from drivetwin.fit.release import release_fixed
from drivetwin.fit.unknown import SoughtNumber
from drivetwin.simulation.network_response import NetworkScenario, simulate_network_batch


@dataclass(frozen=True)
class FitSearchSettings:
    """Settings of the search."""

    points: int = 800
    """Points of the grid on the way to the minimum, about [count]."""
    draws: int = 128
    """Draws of a round of the screen, of the first one the first guess among them [count]."""
    rounds: int = 4
    """Rounds of the screen while no minimum explains the recordings [count]."""
    round_starts: int = 2
    """Draws of a round that are refined, the best [count]."""
    parents: int = 8
    """Best draws so far about which the next round draws [count]."""
    shrinkage: float = 0.5
    """Spread of the draws of a round over that of the round before [ratio]."""
    usual_spread: float = 0.3
    """Relative spread of the draws of a number without prior or bounds [ratio]."""
    accept_chi2: float = 1.05
    """Q per sample, beyond its own scatter, up to which a minimum explains the recordings [-]."""
    far_ratio: float = 4.0
    """Q over that of the best start from which a search is given up after its first steps [-]."""
    same_cost: float = 2.0
    """Difference of Q up to which two starts have led to the same minimum [-]."""
    work: float = 1000.0
    """Work of all starts: 3 to 8 times that of the starts of a recording that the model explains
    [passes]."""
    max_input_rounds: int = 4
    """Largest number of successive minima over the inputs [count]."""
    min_input_decrease: float = 5.0
    """Decrease of Q by the expected inputs from which another minimum is sought [-]."""


FIT_SEARCH = FitSearchSettings()
BENT = GaussNewtonSettings(bend_ratio=0.75)
"""Search whose steps bend along curved valleys, as those of inertias on both sides of a shaft."""


@dataclass(frozen=True, eq=False)
class RefinedStart:
    """Minimum that a start led to: Q there as its expansion by the weighting of the best start
    predicts it, over the samples of the search, and the iterations."""

    point: ParameterVector
    cost: float
    iterations: int


@dataclass(frozen=True, eq=False)
class FoundMinimum:
    """Best minimum, and all that were reached, in the order of their starts.

    `is_limited` is True if the work limit ended the search before a minimum explained the
    recordings. `fixed` are the numbers beside the unknowns that are coordinates of the best one.
    The `shown` omissions are among them; `spread` (p, p) is the covariance that others add.
    """

    result: OptimizeResult[Problem]
    starts: tuple[RefinedStart, ...]
    is_limited: bool
    fixed: tuple[FixedNumber, ...] = ()
    shown: tuple[ShownOmission, ...] = ()
    spread: FloatArray | float = 0.0

    @property
    def agreeing(self) -> int:
        """Number of starts that led to the best minimum."""
        best = min(one.cost for one in self.starts)
        return sum(one.cost - best < FIT_SEARCH.same_cost for one in self.starts)


def search(
    problem: Problem,
    start: ParameterVector,
    sought: Sequence[SoughtNumber],
    fixed: Sequence[FixedNumber],
    stated: Collection[str],
    seed: int,
) -> FoundMinimum:
    """Find the minimum of Q: over the unknowns, then over the fixed numbers as well.

    Parameters
    ----------
    problem
        Terms weighted by the sensors' noise.
    start
        First guess of all unknowns.
    sought
        Unknowns of the network, which come first; those of the starts stay at their guess in the
        screen.
    fixed
        Numbers beside the unknowns that are not exact.
    stated
        Paths of numbers whose distribution is stated.
    seed
        Seed of the draws.

    Raises
    ------
    IdentificationError
        Where no draw can be simulated, or no start leads to a minimum.
    """
    coarse = _coarsen(problem)
    attempts = _Attempts(coarse)
    screen = _Screen(coarse, start, sought, np.random.default_rng(seed))
    with suppress(BudgetExceeded), limit_evaluations(FIT_SEARCH.work) as budget:
        for number in range(FIT_SEARCH.rounds):
            with scale_progress(0.14 * number, 0.14 * (number + 1)):
                for candidate in screen.draw(number):
                    attempts.refine(candidate)
            if attempts.starts and attempts.explains:
                break
    if not attempts.starts:
        raise IdentificationError(
            "the simulation could not be brought onto the recordings from any start",
            "check first guesses, bounds and units against the recordings, and the start speeds",
        )
    with scale_progress(0.58, 1.0):
        best = _polish(problem, attempts.best.point)
        best, moved = release_fixed(best, fixed, len(sought), BENT)
        complete = complete_model(best, stated, BENT)
        best, shown = complete.result, complete.shown
        is_limited = budget.left < 0.0 and not _is_explained(best.normal.cost, problem.size)
        best = best if is_limited else _expect_inputs(best)
        beside = (*moved, *(one.number for one in shown))
        starts = tuple(attempts.starts)
        return FoundMinimum(best, starts, is_limited, beside, shown, complete.spread)


def _coarsen(problem: Problem) -> Problem:
    """Return the problem of fewer samples, for the way to the minimum."""
    terms = [
        NetworkTerm.from_sensor_noise(term.plant, term.record.coarsen(FIT_SEARCH.points))
        for term in problem.terms
    ]
    return replace(problem, terms=tuple(terms))


def _is_explained(cost: float, size: int) -> bool:
    """Return whether Q of `size` samples is about 1 for each."""
    return cost / size < FIT_SEARCH.accept_chi2 + 3.0 * float(np.sqrt(2.0 / size))


class _Attempts:
    """Starts refined by the sensors' noise, compared by the weighting at the best of them."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.weighted = problem
        self.starts: list[RefinedStart] = []
        self.rough = np.inf

    @property
    def best(self) -> RefinedStart:
        """Start with the lowest Q."""
        return min(self.starts, key=lambda one: one.cost)

    @property
    def explains(self) -> bool:
        """True if a minimum explains the recordings: Q per sample is about 1."""
        return _is_explained(self.best.cost, self.problem.size)

    def refine(self, start: ParameterVector) -> None:
        """Refine a start; one that fails is left out."""
        limit = FIT_SEARCH.far_ratio * self.rough
        found = minimise(self.problem, start, rough=True, limit=limit, settings=BENT)
        if found is None:
            return
        if found.normal.cost < self.rough:
            self.rough = found.normal.cost
            self.weighted = self.weighted.update_weighting(found.point)
            self.starts = [self._weigh(one.point, one.iterations) for one in self.starts]
        self.starts.append(self._weigh(found.point, found.iterations))

    def _weigh(self, point: ParameterVector, iterations: int) -> RefinedStart:
        """Compute the minimum of Q that its expansion at a point predicts."""
        normal = self.weighted.normal(point)
        if normal is None:
            return RefinedStart(point, np.inf, iterations)
        below = predict_decrease(self.weighted, point, normal.information, normal.gradient)
        return RefinedStart(point, normal.cost - below, iterations)


def _polish(problem: Problem, point: ParameterVector) -> OptimizeResult[Problem]:
    """Minimise from a point near the minimum, with the weighting recomputed there."""
    found = minimise(problem.update_weighting(point), point, settings=BENT)
    if found is None:
        raise IdentificationError(
            "the simulation fails beside its best start",
            "state priors that keep the unknowns where the driveline can be simulated",
        )
    again = found.problem.update_weighting(found.point)
    return minimise(again, found.point, settings=BENT) or found


def _expect_inputs(found: OptimizeResult[Problem]) -> OptimizeResult[Problem]:
    """Minimise over the inputs as well: drive the runs by those that the residuals show."""
    for _ in range(FIT_SEARCH.max_input_rounds):
        problem = found.problem.update_inputs(found.point)
        again = minimise(problem, found.point, settings=BENT)
        if again is None or again.normal.cost >= found.normal.cost:
            break
        decrease = found.normal.cost - again.normal.cost
        found = again
        if decrease < FIT_SEARCH.min_input_decrease:
            break
    return found


class _Screen:
    """Draws of the unknowns of the network, simulated side by side; starts stay at their guess."""

    def __init__(
        self,
        problem: Problem,
        start: ParameterVector,
        sought: Sequence[SoughtNumber],
        rng: np.random.Generator,
    ) -> None:
        self.problem = problem
        self.start = start
        self.sought = sought
        self.rng = rng
        # Runs side by side have their delays and tables in common.
        self.still = problem.terms[0].plant.list_common()
        self.draws = np.empty((0, len(sought)))
        self.scores = np.empty(0)

    def draw(self, number: int) -> list[ParameterVector]:
        """Return the best draws of a round that can be simulated: of the first from the priors, of
        later ones about the best so far."""
        if number == 0:
            draws = np.array([self._draw_prior(one) for one in self.sought]).T
        else:
            draws = self._draw_about_best(number)
        moving = np.array([one.name not in self.still for one in self.sought])
        draws = np.where(moving, draws, [one.start for one in self.sought])
        scores = np.zeros(len(draws))
        for term in self.problem.terms:
            scores += _compute_scores(term, self.start, draws)
        self.draws = np.concatenate([self.draws, draws])
        self.scores = np.concatenate([self.scores, scores])
        order = np.argsort(scores, kind="stable")[: FIT_SEARCH.round_starts]
        rest = self.start.values[len(self.sought) :]
        return [
            self.start.replace_values(np.concatenate([draws[k], rest]))
            for k in order
            if np.isfinite(scores[k])
        ]

    def _draw_prior(self, one: SoughtNumber) -> FloatArray:
        """Draw coordinates of an unknown from its prior or bounds, the first guess as the first."""
        low, high = one.limits
        if one.spread is None and None not in one.stated.bounds:
            values = self.rng.uniform(low, high, FIT_SEARCH.draws)
        else:
            values = one.start + _get_spread(one) * self.rng.standard_normal(FIT_SEARCH.draws)
        values[0] = one.start
        return np.clip(values, low, high)

    def _draw_about_best(self, number: int) -> FloatArray:
        best = self.draws[np.argsort(self.scores, kind="stable")[: FIT_SEARCH.parents]]
        parents = best[self.rng.integers(len(best), size=FIT_SEARCH.draws)]
        spread = np.array([_get_spread(one) for one in self.sought])
        spread = spread * FIT_SEARCH.shrinkage**number
        limits = np.array([one.limits for one in self.sought])
        draws = parents + spread * self.rng.standard_normal(parents.shape)
        return np.clip(draws, limits[:, 0], limits[:, 1])


def _get_spread(one: SoughtNumber) -> float:
    """Return the standard deviation of the draws of an unknown: of its prior, of even bounds, or
    the usual one."""
    if one.spread is not None:
        return one.spread
    low, high = one.limits
    if None not in one.stated.bounds:
        return float((high - low) / np.sqrt(12.0))
    return FIT_SEARCH.usual_spread * (1.0 if one.is_positive else abs(one.start))


def _compute_scores(term: NetworkTerm, start: ParameterVector, draws: FloatArray) -> FloatArray:
    """Compute the misfit of each of `draws` (n, k) of the unknowns of the network: -2 log
    likelihood with a noise of each output that is unknown beyond that of its sensor; infinite where
    the run fails."""
    task = term.plant.build_task(start, term.record.inputs, term.record.time)
    channels = term.plant.build_channels(start)
    measured = np.full((len(task.outputs), term.record.time.size), np.nan)
    for row, out in zip(measured, term.record.outputs, strict=True):
        own = channels[out.name]
        row[out.centre] = (out.values - own.offset) / own.gain
    scenario = NetworkScenario(task.inputs, task.start)
    sets = term.plant.compute_sets(draws)
    found = simulate_network_batch(
        task.elements, [scenario], task.time, task.outputs, sets, keep=list(measured)
    )
    score = np.zeros(len(draws))
    for out, squares in zip(term.record.outputs, found.values.T, strict=True):
        count = out.values.size
        score += count * np.log1p(squares / (count * out.sigma**2))
    return np.where(np.isfinite(score), score, np.inf)
