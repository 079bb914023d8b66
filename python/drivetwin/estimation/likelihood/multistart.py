# SPDX-License-Identifier: MIT
"""Maximum likelihood with input noise in the covariance, from one or several starts."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import scale_progress
from drivetwin.errors import IdentificationError
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.parametrization import SHAFT, DualClutchProblem
from drivetwin.likelihood.budget import REMEDY, BudgetExceeded
from drivetwin.likelihood.covariance import compute_covariance
from drivetwin.likelihood.gauss_newton import minimise
from drivetwin.likelihood.point import ParameterVector
from drivetwin.likelihood.search import (
    SEARCH,
    Attempts,
    compute_misfit,
    expect_inputs,
    is_near,
    refine_draws,
)
from drivetwin.likelihood.term import RecordedTerm


@dataclass(frozen=True)
class MultiStartSettings:
    """Settings of the search for the global minimum; `chi2` is Q per sample [-]."""

    accept_chi2: float = 1.03
    """Q per sample at or below which no other start is tried [-]."""
    same_chi2: float = 1e-3
    """Difference of Q per sample below which two starts have led to the same minimum [-]."""
    plausible_chi2: float = 2.0
    """Q per sample above which a minimum is rejected as a wrong one [-]."""
    doubtful_chi2: float = 10.0
    """Q per sample with input noise above which a start is doubtful: that of a wrong sampling mode
    is 4 to 5 [-]."""
    far_chi2: float = 4.0
    """Q per sample above which a search with input noise is stopped [-]."""


MULTI_START = MultiStartSettings()
_FAILED = (
    "the simulation could not be brought onto the measurement",
    REMEDY,
)


class NoConvergence(IdentificationError):
    """No start leads near the measurement, for any sampling mode of the signals."""


def fit_multistart(
    problem: DualClutchProblem, start: ParameterVector, thorough: bool = True, draws: bool = True
) -> LikelihoodFit:
    """Fit from `start`: directly if it is near, else from `draws` about it.

    Unless `thorough` the first plausible minimum is taken, good or not. Raises IdentificationError
    where no minimum is plausible, NoConvergence where no draw is near.
    """
    attempts = _iterate_attempts(problem, start) if draws else iter([fit_local(problem, start)])
    best = _select_best(attempts, thorough=thorough)
    if best is None:
        raise IdentificationError(*_FAILED)
    return best


def refine(
    known: LikelihoodFit, problem: DualClutchProblem, start: ParameterVector
) -> LikelihoodFit:
    """Try draws about `start` beside the start that led to `known`; return the best fit."""
    return _select_best(_iterate_draws(problem, start), known) or known


def is_doubtful(problem: DualClutchProblem, point: ParameterVector) -> bool:
    """Return whether Q at a point is as large as at a minimum of a wrong model."""
    cost = problem.update_weighting(point).cost(point)
    return cost > MULTI_START.doubtful_chi2 * problem.size


def find_near_point(problem: DualClutchProblem, start: ParameterVector) -> ParameterVector | None:
    """Find a minimum by the sensors' noise, a doubtful one by two draws; None where none is near
    the measurement."""
    attempts = _begin_attempts(problem)
    if is_near(problem, start):
        attempts.refine(start)
    if attempts.chi2 < MULTI_START.doubtful_chi2:
        return attempts.best.point
    for _ in refine_draws(attempts, start, compute_spread(problem, start)):
        if attempts.agreeing > 1 or attempts.chi2 < MULTI_START.doubtful_chi2:
            break
    return attempts.best.point if attempts.chi2 < SEARCH.near_chi2 else None


STIFFNESS = 10.0 ** np.linspace(-1.0, 1.0, 9)
"""Factors of the stiffness of the shaft over which Q is scanned: a third in frequency apart [-]."""
DAMPING = (0.15, 0.4, 1.0, 2.0)
"""Factors of the damping ratio over which Q is scanned [-]."""


def scan_shaft(problem: DualClutchProblem, start: ParameterVector) -> ParameterVector:
    """Return the best start over frequencies and damping ratios of the shaft; a start that is not
    doubtful stays.

    Q has a minimum for each number of periods of the oscillation. One that decays within few
    samples gives a rough first frequency.
    """
    if not set(SHAFT) <= set(start.names) or not is_doubtful(problem, start):
        return start
    k_o, c_o = (start.names.index(name) for name in SHAFT)
    points = [start]
    for stiffness, damping in product(STIFFNESS.tolist(), DAMPING):
        values = start.values.copy()
        values[k_o] *= stiffness
        values[c_o] *= damping * np.sqrt(stiffness)
        for k, name in enumerate(start.names):
            if name.endswith(".twist"):
                values[k] /= stiffness
        points.append(start.replace_values(np.clip(values, problem.lower, problem.upper)))
    return min(points, key=lambda one: compute_misfit(problem, one))


def compute_spread(problem: DualClutchProblem, start: ParameterVector) -> FloatArray:
    """Compute the standard deviation (p,) of draws about a start: that of the prior, for a number
    that is positive at most the usual share of it; 0 for ratios and the start of a run, which the
    first samples show."""
    precision = np.diag(problem.prior.precision)
    prior = np.sqrt(1.0 / np.maximum(precision, np.finfo(float).tiny))
    usual = SEARCH.usual_spread * np.abs(start.values)
    is_positive = (problem.lower >= 0.0) & (start.values > 0.0)
    spread = np.where(is_positive | (precision == 0.0), np.minimum(prior, usual), prior)
    stays = [one.startswith(("start", "ratio_", "i_f")) for one in start.names]
    return np.where(stays, 0.0, spread)


def _begin_attempts(problem: DualClutchProblem) -> Attempts[DualClutchProblem]:
    terms = (RecordedTerm.from_sensor_noise(one.plant, one.record) for one in problem.terms)
    return Attempts(replace(problem, terms=tuple(terms)))


def _select_best(
    attempts: Iterator[LikelihoodFit | None],
    best: LikelihoodFit | None = None,
    thorough: bool = True,
) -> LikelihoodFit | None:
    """Return the best attempt, `best` included: a good one, or one that is found twice."""
    try:
        for found in _report_progress(attempts):
            if found is None:
                continue
            if best is not None and abs(found.chi2 - best.chi2) < MULTI_START.same_chi2:
                return min(best, found, key=lambda one: one.chi2)
            if best is None or found.chi2 < best.chi2:
                best = found
            if best.chi2 < MULTI_START.accept_chi2 or not thorough:
                return best
    except BudgetExceeded:
        if best is None:
            raise
    return best


def _report_progress(attempts: Iterator[LikelihoodFit | None]) -> Iterator[LikelihoodFit | None]:
    """Report progress over the attempts; each counts as half of the remaining work, because
    their number is not known in advance."""
    done = 0.0
    while True:
        with scale_progress(done, 0.5 + 0.5 * done):
            try:
                found = next(attempts)
            except StopIteration:
                return
        done = 0.5 + 0.5 * done
        yield found


def _iterate_attempts(
    problem: DualClutchProblem, start: ParameterVector
) -> Iterator[LikelihoodFit | None]:
    """Yield fits from `start`, if it is near, and from draws.

    Raises NoConvergence where no fit came of the start and no draw leads near the measurement.
    """
    direct = fit_local(problem, start) if is_near(problem, start) else None
    yield direct
    led = yield from _iterate_draws(problem, start)
    if direct is None and not led:
        raise NoConvergence(*_FAILED)


def _iterate_draws(
    problem: DualClutchProblem, start: ParameterVector
) -> Generator[LikelihoodFit | None, None, bool]:
    """Yield the fit from each draw that leads near the measurement; return whether one does."""
    attempts, tried = _begin_attempts(problem), list[ParameterVector]()
    for _ in refine_draws(attempts, start, compute_spread(problem, start)):
        for one in attempts.starts[len(tried) :]:
            tried.append(one.point)
            if one.cost < SEARCH.near_chi2 * problem.size:
                yield fit_local(problem, one.point)
    return bool(attempts.chi2 < SEARCH.near_chi2)


def fit_local(
    problem: DualClutchProblem, start: ParameterVector, most: float = MULTI_START.far_chi2
) -> LikelihoodFit | None:
    """Find the local minimum of Q with input noise; None if Q per sample stays above `most`.

    First with the inputs as measured, the weighting following the point; then from there with the
    inputs expected at the minimum. Formed elsewhere they would explain a wrong model away.
    """
    limit = most * problem.size
    found = minimise(problem, start, lambda _, point: problem.update_weighting(point), limit=limit)
    if found is None or found.normal.cost > limit:
        return None
    found = expect_inputs(problem, found, limit)
    if found is None:
        return None
    chi2 = (found.normal.cost - problem.prior.compute_prior_cost(found.point.values)) / problem.size
    if chi2 > MULTI_START.plausible_chi2:
        return None
    covariance = compute_covariance(found.problem, found.normal, chi2)
    point, count = found.point, found.iterations
    return LikelihoodFit(found.problem, point, covariance, found.normal, chi2, count)
