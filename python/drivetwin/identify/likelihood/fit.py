# SPDX-License-Identifier: MIT
"""Maximum likelihood from several starts, with input noise in the covariance."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from drivetwin.errors import IdentificationError
from drivetwin.identify.likelihood.output_error import staged
from drivetwin.identify.likelihood.problem import Problem
from drivetwin.identify.likelihood.slow import beyond_white
from drivetwin.identify.likelihood.work import REMEDY, OutOfWork, at_most
from drivetwin.identify.optimize.gauss_newton import Found, minimise
from drivetwin.identify.optimize.objective import Normal, Point
from drivetwin.identify.signals import FloatArray
from drivetwin.progress import part
from drivetwin.shifts.shift import Shift


@dataclass(frozen=True)
class MultiStartSettings:
    """Settings of the search for the global minimum; `chi2` is Q per sample [-]."""

    direct_chi2: float = 120.0
    """Q per sample with input noise at the start below which the direct search comes first [-]."""
    accept_chi2: float = 1.03
    """Q per sample at or below which no other start is tried [-]."""
    same_chi2: float = 1e-3
    """Difference of Q per sample below which two starts have led to the same minimum [-]."""
    shaft_factors: tuple[float, ...] = (1.0, 0.6, 1.6)
    """Factors on the shaft stiffness of the starts, the first 1: the minimum reached depends on
    the stiffness and on the friction level, which the staged start scales by itself [-]."""
    doubtful_chi2: float = 3.0
    """Q per sample after the stages above which a start is doubtful: every other start comes first,
    and of the doubtful ones only the best is fitted. Input noise, which the stages leave out, may
    raise it to hundreds if the outputs are much quieter than the inputs; so `doubtful_input_chi2`
    must be exceeded too [-]."""
    doubtful_input_chi2: float = 10.0
    """The same bound for Q with input noise [-]."""
    min_starts: int = 2
    """Number of starts after which the search ends if none of them is promising [-]."""
    plausible_chi2: float = 2.0
    """Q per sample above which a minimum is rejected as a wrong one [-]."""
    far_chi2: float = 4.0
    """Q per sample above which a search with input noise is given up [-]."""
    min_input_decrease: float = 10.0
    """Decrease of Q by the expected inputs at a minimum from which another minimum is sought: as a
    rule they change Q by less than 5, and no unknown by half a standard deviation [-]."""
    max_input_rounds: int = 5
    """Largest number of successive minima over the inputs: the decrease halves each time [-]."""


MULTI_START = MultiStartSettings()
_FAILED = (
    "the simulation could not be brought onto the measurement",
    REMEDY,
)


class Hopeless(IdentificationError):
    """No start leads near the measurement, for any sampling mode of the signals."""


@dataclass(frozen=True, eq=False)
class LikelihoodFit:
    """Minimum of Q at `point` with the estimate of the unknowns: `mean`, `covariance` (p, p).

    `mean` is the minimum, or the average over minima that the log hardly distinguishes (kinds.py).
    `chi2` is Q per sample less the prior; `problem` holds the weighting at the minimum and `normal`
    the expansion of Q there. The covariance is that of `spread_of`.
    """

    problem: Problem
    point: Point
    mean: Point
    covariance: FloatArray
    normal: Normal
    chi2: float
    iterations: int

    @cached_property
    def deviance(self) -> float:
        """Q + log|Σ|: -2 log of likelihood times prior, up to a constant of the samples.

        Σ is formed anew at the minimum: that of the search is of the point before, where noise
        about P0 opened an element at other instants, and log|Σ| was another by up to a thousand.
        It is no part of a search and counts as no work.
        """
        with at_most(np.inf):
            anew = self.problem.weighted_by(self.point)
            return anew.cost(self.point) + anew.log_determinant


def fit(
    problem: Problem,
    start: Point,
    shifts: Sequence[Shift],
    thorough: bool = True,
    restarts: Sequence[float] = MULTI_START.shaft_factors,
) -> LikelihoodFit:
    """Fit from `start`: directly if it is near, else by stages and from other starts.

    Unless `thorough` the first plausible minimum is taken, good or not. `restarts` are factors on
    the shaft's stiffness, the first of them 1.
    Raises IdentificationError where no minimum is plausible, Hopeless where none is near.
    """
    best = _best_of(_attempts(problem, start, shifts, restarts), thorough=thorough)
    if best is None:
        raise IdentificationError(*_FAILED)
    return best


def checked(
    known: LikelihoodFit, problem: Problem, start: Point, shifts: Sequence[Shift]
) -> LikelihoodFit:
    """Try other starts than the one that led to `known`; return the best fit."""
    return _best_of(_other_attempts(problem, start, shifts), known) or known


def _best_of(
    attempts: Iterator[LikelihoodFit | None],
    best: LikelihoodFit | None = None,
    thorough: bool = True,
) -> LikelihoodFit | None:
    """Return the best attempt, `best` included: a good one, or one that is found twice."""
    try:
        for found in _told(attempts):
            if found is None:
                continue
            if best is not None and abs(found.chi2 - best.chi2) < MULTI_START.same_chi2:
                return min(best, found, key=lambda one: one.chi2)
            if best is None or found.chi2 < best.chi2:
                best = found
            if best.chi2 < MULTI_START.accept_chi2 or not thorough:
                return best
    except OutOfWork:
        if best is None:
            raise
    return best


def _told(attempts: Iterator[LikelihoodFit | None]) -> Iterator[LikelihoodFit | None]:
    """Report progress over the attempts; each counts as half of the remaining work, because
    their number is not known in advance."""
    done = 0.0
    while True:
        with part(done, 0.5 + 0.5 * done):
            try:
                found = next(attempts)
            except StopIteration:
                return
        done = 0.5 + 0.5 * done
        yield found


def _attempts(
    problem: Problem, start: Point, shifts: Sequence[Shift], restarts: Sequence[float]
) -> Iterator[LikelihoodFit | None]:
    """Yield fits from `start` and from points near it, the most promising first.

    Raises Hopeless where the first of these show that none will do.
    """
    if _is_near(problem, start):
        direct = nearest(problem, start)
        yield direct
        restarts = restarts if direct is None else restarts[:1]
    led = yield from _by_stages(problem, start, shifts, restarts)
    if not led and len(restarts) >= MULTI_START.min_starts:
        raise Hopeless(*_FAILED)


def _other_attempts(
    problem: Problem, start: Point, shifts: Sequence[Shift]
) -> Iterator[LikelihoodFit | None]:
    """Yield fits by stages, without the start that `_attempts` began with."""
    restarts = (
        MULTI_START.shaft_factors[:1] if _is_near(problem, start) else MULTI_START.shaft_factors[1:]
    )
    yield from _by_stages(problem, start, shifts, restarts)


def _is_near(problem: Problem, start: Point) -> bool:
    """Return whether the direct search comes first."""
    return problem.weighted_by(start).cost(start) < MULTI_START.direct_chi2 * problem.size


def _by_stages(
    problem: Problem, start: Point, shifts: Sequence[Shift], restarts: Sequence[float]
) -> Generator[LikelihoodFit | None, None, bool]:
    """Yield fits from staged starts; return whether any of them came near the measurement."""
    doubtful: list[Found[Problem]] = []
    promising = 0
    for tried, shaft in enumerate(restarts, 1):
        factor = [shaft if name == "k_o" else 1.0 for name in start.names]
        near = staged(problem, start.moved(start.values * np.array(factor)), shifts)
        if near is None:
            yield None
        elif _is_doubtful(problem, near):
            doubtful.append(near)
        else:
            promising += 1
            yield nearest(problem, near.point)
        if tried == MULTI_START.min_starts and promising == 0:
            break
    if doubtful:
        yield nearest(problem, min(doubtful, key=lambda one: one.normal.cost).point)
    return promising > 0 or bool(doubtful)


def _is_doubtful(problem: Problem, near: Found[Problem]) -> bool:
    """Return whether a staged start ended too far from the measurement for the right minimum."""
    if near.normal.cost <= MULTI_START.doubtful_chi2 * problem.size:
        return False
    with_inputs = problem.weighted_by(near.point)
    return with_inputs.cost(near.point) > MULTI_START.doubtful_input_chi2 * problem.size


def nearest(
    problem: Problem, start: Point, most: float = MULTI_START.far_chi2
) -> LikelihoodFit | None:
    """Find the local minimum of Q with input noise; None if Q per sample stays above `most`.

    First with the inputs as measured, the weighting following the point; then from there with the
    inputs expected at the minimum. Formed elsewhere they would explain a wrong model away.
    """
    limit = most * problem.size
    found = minimise(problem, start, lambda _, point: problem.weighted_by(point), limit=limit)
    if found is None or found.normal.cost > limit:
        return None
    found = _over_inputs(problem, found, limit)
    if found is None:
        return None
    chi2 = (found.normal.cost - problem.prior.cost(found.point.values)) / problem.size
    if chi2 > MULTI_START.plausible_chi2:
        return None
    covariance = spread_of(found.problem, found.normal, chi2)
    point, count = found.point, found.iterations
    return LikelihoodFit(found.problem, point, point, covariance, found.normal, chi2, count)


def _over_inputs(problem: Problem, found: Found[Problem], limit: float) -> Found[Problem] | None:
    """Find the joint minimum over unknowns and inputs, from the one with the measured inputs.

    Where an element slips at a pressure that is steady but for its noise, that noise seems to tell
    μ from P0: the inputs expected at one minimum then lead to another, and so on. None where the
    first search does not end. `iterations` counts those of all searches.
    """
    joint: Found[Problem] | None = None
    expected = found.problem.with_expected_inputs(found.point)
    for _ in range(MULTI_START.max_input_rounds):
        following = minimise(expected, found.point, limit=limit)
        if following is None or not following.converged:
            break
        joint = found = replace(following, iterations=found.iterations + following.iterations)
        expected = problem.weighted_by(found.point).with_expected_inputs(found.point)
        if found.normal.cost - expected.cost(found.point) < MULTI_START.min_input_decrease:
            break
    return joint


def spread_of(problem: Problem, normal: Normal, chi2: float) -> FloatArray:
    """Compute the covariance (p, p) at a minimum, widened by residual power beyond sensor noise.

    The whole is widened where `chi2` exceeds 1, and by slow errors where an output shows them, as
    far as the unknowns hang on that output.
    """
    inverse, counted = covariance_of(normal.information), max(chi2, 1.0)
    return counted * inverse + inverse @ beyond_white(problem, normal, counted) @ inverse


def covariance_of(matrix: FloatArray) -> FloatArray:
    """Invert an information matrix (p, p) after scaling to a unit diagonal."""
    scale = np.sqrt(np.diag(matrix))
    inverse = np.linalg.pinv(matrix / np.outer(scale, scale), rcond=1e-14, hermitian=True)
    return np.asarray(inverse / np.outer(scale, scale))
