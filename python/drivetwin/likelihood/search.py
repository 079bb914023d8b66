# SPDX-License-Identifier: MIT
"""Search for the minimum of Q: from the first guess, then from draws about it.

A simulation with another order of events has a gradient that does not lead to the right one, so
that a search from one start ends in a wrong minimum in every fifth case. A start near the
measurement is refined at once. Otherwise draws are simulated, and the best of them are refined by
the noise of the sensors alone, in rounds.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import scale_progress
from drivetwin.likelihood.budget import RUN, charge
from drivetwin.likelihood.gauss_newton import (
    GAUSS_NEWTON,
    OptimizeResult,
    minimise,
    predict_decrease,
)
from drivetwin.likelihood.objective import LikelihoodObjective
from drivetwin.likelihood.point import ParameterVector


@dataclass(frozen=True)
class SearchSettings:
    """Settings of the search; `chi2` is Q per sample [-]."""

    near_chi2: float = 120.0
    """Q per sample with input noise up to which a start is near the measurement [-]."""
    draws: int = 128
    """Draws of a round, of the first one the start among them [count]."""
    rounds: int = 4
    """Rounds of draws while no minimum explains the recordings, and none is reached again
    [count]."""
    round_starts: int = 2
    """Draws of a round that are refined, the best [count]."""
    usual_spread: float = 0.3
    """Relative spread of the draws of a number without prior or bounds [ratio]."""
    far_ratio: float = 4.0
    """Q over that of the best start from which a search is given up after its first steps [-]."""
    same_cost: float = 2.0
    """Difference of Q, beside that at which a rough search ends, up to which two starts have led to
    the same minimum [-]."""
    max_input_rounds: int = 5
    """Largest number of successive minima over the inputs: the decrease halves each time
    [count]."""
    min_input_decrease: float = 10.0
    """Decrease of Q by the expected inputs at a minimum from which another minimum is sought: as a
    rule they change Q by less than 5, and no unknown by half a standard deviation [-]."""


SEARCH = SearchSettings()

P = TypeVar("P", bound=LikelihoodObjective[Any])


def is_near(problem: LikelihoodObjective[Any], start: ParameterVector) -> bool:
    """Return whether a start is near the measurement, for its sensor and input noise."""
    return problem.update_weighting(start).cost(start) < SEARCH.near_chi2 * problem.size


@dataclass(frozen=True, eq=False)
class RefinedStart:
    """Minimum that a start led to: Q there as its expansion by the weighting of the best start
    predicts it, over the samples of the search, and the iterations."""

    point: ParameterVector
    cost: float
    iterations: int


class Attempts(Generic[P]):
    """Starts refined by the sensors' noise, compared by the weighting at the best of them."""

    def __init__(self, problem: P) -> None:
        self.problem = problem
        self.weighted = problem
        self.starts: list[RefinedStart] = []
        self.rough = np.inf

    @property
    def best(self) -> RefinedStart:
        """Start with the lowest Q."""
        return min(self.starts, key=lambda one: one.cost)

    @property
    def agreeing(self) -> int:
        """Number of starts that led to the best minimum."""
        return sum(self._compare())

    def is_confirmed(self, first: int) -> bool:
        """Return whether one of the `first` starts and a later one led to the best minimum."""
        agreeing = self._compare()
        return any(agreeing[:first]) and any(agreeing[first:])

    def _compare(self) -> list[bool]:
        """Compare each start with the best one: whether it led to the same minimum."""
        best = self.best.cost if self.starts else np.inf
        apart = SEARCH.same_cost + GAUSS_NEWTON.rough_rtol * best
        return [one.cost - best < apart for one in self.starts]

    @property
    def chi2(self) -> float:
        """Q per sample at the best start; infinite without one."""
        return self.best.cost / self.problem.size if self.starts else np.inf

    def refine(self, start: ParameterVector) -> None:
        """Refine a start; one that fails is left out."""
        limit = SEARCH.far_ratio * self.rough
        found = minimise(self.problem, start, rough=True, limit=limit)
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


def refine_draws(
    attempts: Attempts[P], start: ParameterVector, spread: FloatArray, seed: int = 0
) -> Iterator[None]:
    """Refine the best draws about a start, in rounds, until one leads to the best minimum of the
    rounds before.

    Parameters
    ----------
    attempts
        Starts that are refined; each draw adds one.
    start
        First draw.
    spread
        Standard deviation (p,) of the draws of each unknown, 0 for one that stays.
    seed
        Seed of the draws.

    Yields
    ------
    None
        After each draw.
    """
    screen = _Screen(attempts.problem, start, spread, np.random.default_rng(seed))
    share = 1.0 / SEARCH.rounds
    for number in range(SEARCH.rounds):
        known = len(attempts.starts)
        with scale_progress(share * number, share * (number + 1)):
            for candidate in screen.draw(with_start=not attempts.starts):
                attempts.refine(candidate)
                yield
                if attempts.is_confirmed(known):
                    return


def find_best_draw(
    problem: LikelihoodObjective[Any], start: ParameterVector, spread: FloatArray
) -> ParameterVector:
    """Return the best of the draws about a start; the start where none can be simulated."""
    screen = _Screen(problem, start, spread, np.random.default_rng(0))
    return next(iter(screen.draw(with_start=True)), start)


class _Screen:
    """Draws about a start, simulated one by one."""

    def __init__(
        self,
        problem: LikelihoodObjective[Any],
        start: ParameterVector,
        spread: FloatArray,
        rng: np.random.Generator,
    ) -> None:
        self.problem = problem
        self.start = start
        self.spread = spread
        self.rng = rng

    def draw(self, *, with_start: bool) -> list[ParameterVector]:
        """Return the best draws of a round that can be simulated, the start among them or not: a
        start that is refined twice agrees with itself.

        Each round draws anew: draws about the best so far lead to the minimum that is known.
        """
        scatter = self.rng.standard_normal((SEARCH.draws, self.spread.size))
        scatter[0] *= not with_start
        draws = self.start.values + self.spread * scatter
        draws = np.clip(draws, self.problem.lower, self.problem.upper)
        points = [self.start.replace_values(one) for one in draws]
        scores = np.array([compute_misfit(self.problem, one) for one in points])
        order = np.argsort(scores, kind="stable")[: SEARCH.round_starts]
        return [points[k] for k in order if np.isfinite(scores[k])]


def compute_misfit(problem: LikelihoodObjective[Any], point: ParameterVector) -> float:
    """Compute -2 log likelihood with a noise of each output that is unknown beyond that of its
    sensor; infinite where the run fails."""
    charge(RUN)
    total = 0.0
    for term in problem.terms:
        residual = term.evaluate(point)
        if residual is None:
            return np.inf
        first = 0
        for out in term.record.outputs:
            count = out.values.size
            own = residual[first : first + count]
            first += count
            total += count * float(np.log1p(own @ own / (count * out.sigma**2)))
    return total


def expect_inputs(
    problem: P,
    found: OptimizeResult[P],
    limit: float = np.inf,
) -> OptimizeResult[P] | None:
    """Find the joint minimum over unknowns and inputs, from the one with the measured inputs.

    For an element that slips at a constant noisy pressure, the noise is mistaken for information
    that separates μ from P0. The inputs expected at one minimum then lead to another minimum, so
    the search is repeated. Returns None if the first search does not converge. `iterations` is the
    sum over all searches. `problem` has the inputs as read.
    """
    joint: OptimizeResult[P] | None = None
    expected = found.problem.update_inputs(found.point)
    for _ in range(SEARCH.max_input_rounds):
        following = minimise(expected, found.point, limit=limit)
        if following is None:
            break
        # Of a log without noise Q is rough on the scale of a minimum, and explained all the same.
        if not following.converged and following.normal.cost > problem.size:
            break
        joint = found = replace(following, iterations=found.iterations + following.iterations)
        expected = problem.update_weighting(found.point).update_inputs(found.point)
        if found.normal.cost - expected.cost(found.point) < SEARCH.min_input_decrease:
            break
    return joint
