# SPDX-License-Identifier: MIT
"""Search for the minimum of a fit: over its unknowns, the fixed numbers and the omissions."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import scale_progress
from drivetwin.errors import IdentificationError
from drivetwin.fit.fixed_numbers import FixedNumber
from drivetwin.fit.omissions import ShownOmission, complete_model, is_explained
from drivetwin.fit.plant import NetworkTerm, Problem
from drivetwin.fit.recording import lower_noise
from drivetwin.fit.release import extend, release_fixed
from drivetwin.fit.unknown import SoughtNumber
from drivetwin.likelihood.budget import MAX_REFIT_WORK, BudgetExceeded, limit_evaluations
from drivetwin.likelihood.gauss_newton import OptimizeResult, minimise
from drivetwin.likelihood.point import ParameterVector
from drivetwin.likelihood.search import (
    SEARCH,
    Attempts,
    RefinedStart,
    expect_inputs,
    refine_draws,
)


@dataclass(frozen=True)
class FitSearchSettings:
    """Settings of the search beside those of `SEARCH`."""

    points: int = 800
    """Points of the grid on the way to the minimum, about [count]."""
    work: float = 2500.0
    """Work of all starts: four rounds of draws [passes]."""


FIT_SEARCH = FitSearchSettings()


@dataclass(frozen=True, eq=False)
class FoundMinimum:
    """Best minimum, and all that were reached, in the order of their starts; `agreeing` led to the
    best one.

    `is_limited` is True if the work limit ended the search before a minimum explained the
    recordings. `fixed` are the numbers beside the unknowns that are coordinates of the best one.
    The `shown` omissions are among them; `spread` (p, p) is the covariance that others add.
    """

    result: OptimizeResult[Problem]
    starts: tuple[RefinedStart, ...]
    agreeing: int
    is_limited: bool
    fixed: tuple[FixedNumber, ...] = ()
    shown: tuple[ShownOmission, ...] = ()
    spread: FloatArray | float = 0.0


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
    guess = _Guess(start, np.array([_get_spread(one) for one in sought]), seed)
    with scale_progress(0.0, 0.7):
        attempts = _refine_guess(problem, guess)
        if fixed and not _is_noise(attempts):
            found = _find_beside(problem, guess, attempts, fixed)
        else:
            found = _release(_find(problem, guess, attempts), fixed, len(sought))
    with scale_progress(0.7, 1.0):
        return _complete(found, stated)


@dataclass(frozen=True, eq=False)
class _Guess:
    """First guess of all unknowns, and the standard deviations (k,) of the draws of the first ones;
    the others stay at it."""

    point: ParameterVector
    spread: FloatArray
    seed: int


def _refine_guess(problem: Problem, guess: _Guess) -> Attempts[Problem]:
    """Minimise from the first guess, on fewer samples."""
    attempts = Attempts(_coarsen(problem))
    with suppress(BudgetExceeded), limit_evaluations(FIT_SEARCH.work):
        attempts.refine(guess.point)
    return attempts


def _seek(problem: Problem, guess: _Guess, attempts: Attempts[Problem]) -> FoundMinimum:
    """Find the minimum from the first guess, where the `attempts` begin, and from draws about
    it."""
    spread = np.pad(guess.spread, (0, guess.point.values.size - guess.spread.size))
    with suppress(BudgetExceeded), limit_evaluations(FIT_SEARCH.work) as budget:
        if not _is_settled(attempts):
            for _ in refine_draws(attempts, guess.point, spread, guess.seed):
                if _is_settled(attempts):
                    break
    if not attempts.starts:
        raise IdentificationError(
            "the simulation could not be brought onto the recordings from any start",
            "check first guesses, bounds and units against the recordings, and the start speeds",
        )
    best = _polish(problem, attempts.best.point)
    return FoundMinimum(best, tuple(attempts.starts), attempts.agreeing, budget.left < 0.0)


def _find(problem: Problem, guess: _Guess, attempts: Attempts[Problem]) -> FoundMinimum:
    """Find the minimum by the noise that is left there; again where that explains less."""
    first = _seek(problem, guess, attempts)
    found = _lower_estimates(first)
    if found is first or is_explained(found.result):
        return found
    quieter = found.result.problem
    again = _seek(quieter, guess, _refine_guess(quieter, guess))
    if again.result.normal.cost < found.result.normal.cost:
        return _lower_estimates(again)
    return found


def _find_beside(
    problem: Problem, guess: _Guess, attempts: Attempts[Problem], fixed: Sequence[FixedNumber]
) -> FoundMinimum:
    """Find the minimum over unknowns and fixed numbers from the first guess.

    Wrong fixed numbers lead the unknowns astray where these are sought alone. Fixed numbers that
    are free may lead into a wrong minimum too; so the unknowns are sought alone where all together
    do not explain the recordings.
    """
    wide, point = extend(problem, guess.point, fixed)
    beside = replace(guess, point=point)
    found = replace(_find(wide, beside, _refine_guess(wide, beside)), fixed=tuple(fixed))
    if is_explained(found.result):
        return found
    other = _release(_find(problem, guess, attempts), fixed, guess.spread.size)
    return min(found, other, key=lambda one: one.result.normal.cost)


def _release(found: FoundMinimum, fixed: Sequence[FixedNumber], count: int) -> FoundMinimum:
    """Minimise over the fixed numbers as well, from the minimum over `count` unknowns; that minimum
    where the work of a refit does not suffice."""
    try:
        with limit_evaluations(MAX_REFIT_WORK):
            best, moved = release_fixed(found.result, fixed, count)
    except BudgetExceeded:
        return replace(found, is_limited=True)
    return replace(found, result=best, fixed=moved)


def _complete(found: FoundMinimum, stated: Collection[str]) -> FoundMinimum:
    """Minimise over the omissions as well."""
    complete = complete_model(found.result, stated)
    best, shown = complete.result, complete.shown
    is_limited = found.is_limited and not is_explained(best)
    best = best if is_limited else expect_inputs(best.problem, best) or best
    return replace(
        found,
        result=best,
        is_limited=is_limited,
        fixed=(*found.fixed, *(one.number for one in shown)),
        shown=shown,
        spread=complete.spread,
    )


def _coarsen(problem: Problem) -> Problem:
    """Return the problem of fewer samples, for the way to the minimum."""
    terms = [
        NetworkTerm.from_sensor_noise(term.plant, term.record.coarsen(FIT_SEARCH.points))
        for term in problem.terms
    ]
    return replace(problem, terms=tuple(terms))


def _is_noise(attempts: Attempts[Problem], deviations: float = 3.0) -> bool:
    """Return whether the least Q per sample, without priors, is 1 within so many standard
    deviations of its scatter."""
    if not attempts.starts:
        return False
    best, size = attempts.best, attempts.problem.size
    cost = best.cost - attempts.problem.prior.compute_prior_cost(best.point.values)
    return cost < size + deviations * float(np.sqrt(2.0 * size))


def _is_settled(attempts: Attempts[Problem]) -> bool:
    """Return whether the best start needs no other: it explains the recordings, and where its Q is
    beyond one standard deviation of the scatter, another start has led to it. A wrong minimum may
    be no more than 3 % above the right one."""
    return _is_noise(attempts, 1.0 if attempts.agreeing < 2 else 3.0)


def _is_far(cost: float, size: int) -> bool:
    """Return whether Q of a point is not near the measurement."""
    return not cost < SEARCH.near_chi2 * size


def _polish(problem: Problem, point: ParameterVector) -> OptimizeResult[Problem]:
    """Minimise from the best point of the search, with the weighting recomputed there.

    One that is not near the measurement is no estimate, whatever its last digits.
    """
    weighted = problem.update_weighting(point)
    is_far = _is_far(weighted.cost(point), problem.size)
    found = minimise(weighted, point, rough=is_far)
    if found is None:
        raise IdentificationError(
            "the simulation fails beside its best start",
            "state priors that keep the unknowns where the driveline can be simulated",
        )
    if _is_far(found.normal.cost, problem.size):
        return found
    again = found.problem.update_weighting(found.point)
    return minimise(again, found.point) or found


def _lower_estimates(found: FoundMinimum) -> FoundMinimum:
    """Minimise again while the noise of the residual is less than its estimate."""
    while (quieter := _lower_noise(found.result)) is not None:
        found = replace(found, result=_polish(quieter, found.result.point))
    return found


def _lower_noise(found: OptimizeResult[Problem]) -> Problem | None:
    """Return the problem with the noise that the residual has at a minimum, by the sensors' noise.

    None where it is not less than its estimate from the samples, or the recordings are unexplained.
    """
    terms = zip(found.problem.terms, found.normal.residuals, strict=True)
    if found.normal.cost > found.problem.size:
        return None
    records = [(term, lower_noise(term.record, residual)) for term, residual in terms]
    if all(np.array_equal(term.record.sigma, record.sigma) for term, record in records):
        return None
    quieter = [NetworkTerm.from_sensor_noise(term.plant, record) for term, record in records]
    return replace(found.problem, terms=tuple(quieter))


def _get_spread(one: SoughtNumber) -> float:
    """Return the standard deviation of the draws of an unknown: of its prior, of even bounds, or
    the usual one."""
    if one.spread is not None:
        return one.spread
    low, high = one.limits
    if None not in one.stated.bounds:
        return float((high - low) / np.sqrt(12.0))
    return SEARCH.usual_spread * (1.0 if one.is_positive else abs(one.start))
