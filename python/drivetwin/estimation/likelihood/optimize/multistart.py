# SPDX-License-Identifier: MIT
"""Maximum likelihood from several starts, with input noise in the covariance.

A start that is far off is staged. The simulation of a whole shift with wrong parameters locks at
the wrong time, and Q has local minima. Fitted piece by piece it has none in practice: first the
lower gear alone, which fixes inertia, load and shaft; then up to lock-up, which fixes the friction;
then all. Of friction the lower gear shows nothing, so it is held there; and since Q has minima over
its level too, that is looked for by simulation alone before the search goes on from the best.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.progress import scale_progress
from drivetwin.errors import IdentificationError
from drivetwin.estimation.likelihood.budget import REMEDY, BudgetExceeded
from drivetwin.estimation.likelihood.fit import LikelihoodFit, compute_covariance
from drivetwin.estimation.likelihood.shift_objective import ShiftObjective, ShiftTerm
from drivetwin.estimation.optimize.gauss_newton import OptimizeResult, minimise
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.shifts.shift import Shift

LOCAL_UNKNOWNS = ("J_e", "J_out", "J_vehicle", "k_o", "c_o")
"""Unknowns that a stage seeks about its start only: a short span hardly shows some of them, and
far off the driveline is so stiff that one run takes as long as a whole fit."""
LEVEL = "mu_c"


@dataclass(frozen=True)
class StagedStartSettings:
    """Settings of the staged output-error start."""

    clearance: float = 0.02
    """Distance kept from the phase boundary at which a stage ends [s]."""
    search_factor: float = 10.0
    """Factor to either side of the start within which the unknowns `SOUGHT` are sought [-]."""
    max_chi2: float = 20.0
    """Q per sample with input noise after a stage above which no other follows [-]."""
    min_friction_factor: float = 0.5
    """Smallest factor on the friction level that is tried [-]."""
    max_friction_factor: float = 2.0
    """Largest factor on the friction level that is tried [-]."""
    friction_factors: int = 13
    """Number of factors on the friction level, evenly spaced in the logarithm [-]."""
    friction_passes: int = 2
    """Number of passes over the elements: the instant at which one breaks away depends on the
    other [-]."""


STAGED_START = StagedStartSettings()


def find_staged_start(
    problem: ShiftObjective, start: ParameterVector, shifts: Sequence[Shift]
) -> OptimizeResult[ShiftObjective] | None:
    """Fit the output error over growing spans, weighted by sensor noise.

    Returns None if a run fails, or if a stage ends far from the measurement.
    """
    problem = _restrict_bounds(problem, start)
    found = fit_lower_gear_only(problem, start, shifts)
    if found is None or _is_too_far(found):
        return None
    slipping = problem.cut([s.lockup_time - STAGED_START.clearance for s in shifts])
    found = minimise(slipping, scale_friction(slipping, found.point), rough=True)
    if found is None or _is_too_far(found):
        return None
    plain = replace(
        problem,
        terms=tuple(ShiftTerm.from_sensor_noise(p.plant, p.record) for p in problem.terms),
    )
    found = minimise(plain, found.point, rough=True)
    return None if found is None or _is_too_far(found) else found


def fit_lower_gear_only(
    problem: ShiftObjective, start: ParameterVector, shifts: Sequence[Shift]
) -> OptimizeResult[ShiftObjective] | None:
    """Fit the output error over the gear before each shift alone; None if a run fails."""
    gear = _fix_friction(_restrict_bounds(problem, start), start)
    return minimise(
        gear.cut([s.before[1] - STAGED_START.clearance for s in shifts]), start, rough=True
    )


def _is_too_far(found: OptimizeResult[ShiftObjective]) -> bool:
    """Return whether a stage ended too far from the measurement for input noise to explain it."""
    problem = found.problem.update_weighting(found.point)
    return problem.cost(found.point) > STAGED_START.max_chi2 * problem.size


def _fix_friction(problem: ShiftObjective, start: ParameterVector) -> ShiftObjective:
    """Fix all parameters of the elements at the start."""
    prior = problem.prior
    elements = {one.name for term in problem.terms for one in term.plant.elements}
    for k, name in enumerate(start.names):
        if name.rpartition(".")[0] in elements:
            prior = prior.fix_parameter(k, start[name])
    return replace(problem, prior=prior)


def scale_friction(problem: ShiftObjective, point: ParameterVector) -> ParameterVector:
    """Scale the friction levels to the tried factors with the smallest Q."""
    factors = np.geomspace(
        STAGED_START.min_friction_factor,
        STAGED_START.max_friction_factor,
        STAGED_START.friction_factors,
    )
    levels = [k for k, name in enumerate(point.names) if name.endswith(f".{LEVEL}")]
    for k in levels * STAGED_START.friction_passes:
        trials = []
        for factor in factors:
            values = point.values.copy()
            values[k] = np.clip(factor * values[k], problem.lower[k], problem.upper[k])
            trials.append(point.replace_values(values))
        point = min(trials, key=problem.cost)
    return point


def _restrict_bounds(problem: ShiftObjective, start: ParameterVector) -> ShiftObjective:
    """Restrict positive unknowns of `SOUGHT` to bounds about the start."""
    sought = np.array([name in LOCAL_UNKNOWNS for name in start.names]) & (start.values > 0.0)
    lower = np.where(
        sought, np.maximum(problem.lower, start.values / STAGED_START.search_factor), problem.lower
    )
    upper = np.where(
        sought, np.minimum(problem.upper, start.values * STAGED_START.search_factor), problem.upper
    )
    return replace(problem, lower=lower, upper=upper)


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
    """Bound like `doubtful_chi2`, for Q with input noise [-]."""
    min_starts: int = 2
    """Number of starts after which the search ends if none of them is promising [-]."""
    plausible_chi2: float = 2.0
    """Q per sample above which a minimum is rejected as a wrong one [-]."""
    far_chi2: float = 4.0
    """Q per sample above which a search with input noise is stopped [-]."""
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


class NoConvergence(IdentificationError):
    """No start leads near the measurement, for any sampling mode of the signals."""


def fit_multistart(
    problem: ShiftObjective,
    start: ParameterVector,
    shifts: Sequence[Shift],
    thorough: bool = True,
    restarts: Sequence[float] = MULTI_START.shaft_factors,
) -> LikelihoodFit:
    """Fit from `start`: directly if it is near, else by stages and from other starts.

    Unless `thorough` the first plausible minimum is taken, good or not. `restarts` are factors on
    the shaft's stiffness, the first of them 1.
    Raises IdentificationError where no minimum is plausible, NoConvergence where none is near.
    """
    best = _select_best(_iterate_attempts(problem, start, shifts, restarts), thorough=thorough)
    if best is None:
        raise IdentificationError(*_FAILED)
    return best


def refine(
    known: LikelihoodFit,
    problem: ShiftObjective,
    start: ParameterVector,
    shifts: Sequence[Shift],
) -> LikelihoodFit:
    """Try other starts than the one that led to `known`; return the best fit."""
    return _select_best(_iterate_other_attempts(problem, start, shifts), known) or known


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
    problem: ShiftObjective,
    start: ParameterVector,
    shifts: Sequence[Shift],
    restarts: Sequence[float],
) -> Iterator[LikelihoodFit | None]:
    """Yield fits from `start` and from points near it, the most promising first.

    Raises NoConvergence where the first of these show that none will do.
    """
    if _is_near(problem, start):
        direct = fit_local(problem, start)
        yield direct
        restarts = restarts if direct is None else restarts[:1]
    led = yield from _iterate_staged_starts(problem, start, shifts, restarts)
    if not led and len(restarts) >= MULTI_START.min_starts:
        raise NoConvergence(*_FAILED)


def _iterate_other_attempts(
    problem: ShiftObjective, start: ParameterVector, shifts: Sequence[Shift]
) -> Iterator[LikelihoodFit | None]:
    """Yield fits by stages, without the start that `_iterate_attempts` began with."""
    restarts = (
        MULTI_START.shaft_factors[:1] if _is_near(problem, start) else MULTI_START.shaft_factors[1:]
    )
    yield from _iterate_staged_starts(problem, start, shifts, restarts)


def _is_near(problem: ShiftObjective, start: ParameterVector) -> bool:
    """Return whether the direct search comes first."""
    return problem.update_weighting(start).cost(start) < MULTI_START.direct_chi2 * problem.size


def _iterate_staged_starts(
    problem: ShiftObjective,
    start: ParameterVector,
    shifts: Sequence[Shift],
    restarts: Sequence[float],
) -> Generator[LikelihoodFit | None, None, bool]:
    """Yield fits from staged starts; return whether any of them came near the measurement."""
    doubtful: list[OptimizeResult[ShiftObjective]] = []
    promising = 0
    for tried, shaft in enumerate(restarts, 1):
        factor = [shaft if name == "k_o" else 1.0 for name in start.names]
        near = find_staged_start(
            problem, start.replace_values(start.values * np.array(factor)), shifts
        )
        if near is None:
            yield None
        elif _is_doubtful(problem, near):
            doubtful.append(near)
        else:
            promising += 1
            yield fit_local(problem, near.point)
        if tried == MULTI_START.min_starts and promising == 0:
            break
    if doubtful:
        yield fit_local(problem, min(doubtful, key=lambda one: one.normal.cost).point)
    return promising > 0 or bool(doubtful)


def _is_doubtful(problem: ShiftObjective, near: OptimizeResult[ShiftObjective]) -> bool:
    """Return whether a staged start ended too far from the measurement for the right minimum."""
    if near.normal.cost <= MULTI_START.doubtful_chi2 * problem.size:
        return False
    with_inputs = problem.update_weighting(near.point)
    return with_inputs.cost(near.point) > MULTI_START.doubtful_input_chi2 * problem.size


def fit_local(
    problem: ShiftObjective, start: ParameterVector, most: float = MULTI_START.far_chi2
) -> LikelihoodFit | None:
    """Find the local minimum of Q with input noise; None if Q per sample stays above `most`.

    First with the inputs as measured, the weighting following the point; then from there with the
    inputs expected at the minimum. Formed elsewhere they would explain a wrong model away.
    """
    limit = most * problem.size
    found = minimise(problem, start, lambda _, point: problem.update_weighting(point), limit=limit)
    if found is None or found.normal.cost > limit:
        return None
    found = _fit_inputs(problem, found, limit)
    if found is None:
        return None
    chi2 = (found.normal.cost - problem.prior.compute_prior_cost(found.point.values)) / problem.size
    if chi2 > MULTI_START.plausible_chi2:
        return None
    covariance = compute_covariance(found.problem, found.normal, chi2)
    point, count = found.point, found.iterations
    return LikelihoodFit(found.problem, point, point, covariance, found.normal, chi2, count)


def _fit_inputs(
    problem: ShiftObjective, found: OptimizeResult[ShiftObjective], limit: float
) -> OptimizeResult[ShiftObjective] | None:
    """Find the joint minimum over unknowns and inputs, from the one with the measured inputs.

    For an element that slips at a constant noisy pressure, the noise is mistaken for information
    that separates μ from P0. The inputs expected at one minimum then lead to another minimum, so
    the search is repeated. Returns None if the first search does not converge. `iterations` is the
    sum over all searches.
    """
    joint: OptimizeResult[ShiftObjective] | None = None
    expected = found.problem.update_inputs(found.point)
    for _ in range(MULTI_START.max_input_rounds):
        following = minimise(expected, found.point, limit=limit)
        if following is None or not following.converged:
            break
        joint = found = replace(following, iterations=found.iterations + following.iterations)
        expected = problem.update_weighting(found.point).update_inputs(found.point)
        if found.normal.cost - expected.cost(found.point) < MULTI_START.min_input_decrease:
            break
    return joint
