# SPDX-License-Identifier: MIT
"""Sampling modes of the signals: samples or means, engine torque linear or curved.

An output may be the mean over the time since the sample before, as encoders on a bus send it. That
is half a sample late, and half a millisecond between torque and speed moves k_o and c_o by several
standard deviations. Between its samples an engine torque may be straight or a curve
(`compute_bend`). Which mode may fit better follows from the expansion of Q for one of them: that of
the others differs by a known column each.

Where all outputs are of the other mode, which is nearly a delay of the inputs, fits compare by
their deviance and not by Q: with θ the unknowns, y the samples and δ the noise of the inputs u, of
covariance C, the likelihood is

    L(θ) = ∫ p(y | θ, u - δ)·p(δ) dδ,   -2·log L = Q + log|Σ| + n·log 2π,   Σ = R + G·C·Gᵀ

where Q is the least over δ (Laplace's approximation; exact where the outputs are linear in δ, by
|R + G·C·Gᵀ| = |R|·|1 + C·GᵀR⁻¹G|). G is that of the run at the minimum, so Σ depends on the mode
through the unknowns that go with it: when elements slip, and at what pressures. A delay of the
inputs moves these so far that log|Σ| differs by up to 40, mostly against the difference of Q: what
gives pressure noise more room leaves less. It is no sure judge either: noise about P0 moves both
terms by several. Other modes move P0 and friction so little that Q decides between them.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.mechanism import Mechanism, is_enabled
from drivetwin.estimation.likelihood.multistart import MULTI_START, find_near_point, fit_local
from drivetwin.estimation.likelihood.parametrization import DualClutchProblem, DualClutchTerm
from drivetwin.estimation.likelihood.torque_record import OUTPUT_TORQUE, OUTPUTS, TORQUE
from drivetwin.estimation.result.estimate import Z95
from drivetwin.findings import Code, Finding, report
from drivetwin.likelihood.budget import BudgetExceeded
from drivetwin.likelihood.coloured_noise import compute_block_means, split_whitened
from drivetwin.likelihood.column_products import compute_column_products
from drivetwin.likelihood.gauss_newton import solve_step
from drivetwin.likelihood.point import NormalEquations, ParameterVector
from drivetwin.likelihood.search import SEARCH
from drivetwin.likelihood.term import RecordedTerm

SIGNALS = (*OUTPUTS, TORQUE)
SPEEDS = tuple(name for name in OUTPUTS if name.endswith("speed"))
COMMON_PRICE = 4.0
"""Fall of Q, or of the deviance, from which on all speeds count as means, or the engine torque as
a curve: encoders that send means are common, at odds of e² against them."""
RARE_PRICE = 8.0
"""Fall of Q, or of the deviance, from which on the output torque alone, or one speed alone, has
another mode than the rest: rare, at odds of e⁴. Half a millisecond of the torque is six standard
deviations of its delay."""
TIE = 6.0
"""Rise of the same below which the 95 % interval reaches the minimum of the other mode,
whatever its weight: odds of 20."""
WORSE = 1.1
"""Q per sample, as a factor, from which on other modes are surely no better."""
ROUNDS = 3
"""Most changes of mode: far off, the expansion promises the way, not the end of it."""


def get_modes(problem: DualClutchProblem) -> frozenset[str]:
    """Return the names of the signals that are of another mode than read, as in `Record.modes`."""
    return frozenset[str]().union(*(term.record.modes for term in problem.terms))


def select_modes(problem: DualClutchProblem, names: Collection[str]) -> DualClutchProblem:
    """Set the sampling modes of all signals to those of `names`; all must be as read."""
    terms = [
        RecordedTerm.from_sensor_noise(p.plant, p.record.select_modes(names)) for p in problem.terms
    ]
    return replace(problem, terms=tuple(terms))


def select_sampling_mode(
    problem: DualClutchProblem, start: ParameterVector
) -> tuple[ParameterVector, DualClutchProblem, DualClutchProblem]:
    """Return a point near the measurement, the problem, which has signals as read, with the modes
    that promise least from there, and with the speeds of the other mode.

    From far off an expansion promises anything: at ten times the noise, where logs without an
    output torque start, a mixture of modes by a thousand of Q. From there a minimum near the
    measurement is sought first; where there is none the signals are taken as read.
    """
    is_chosen = is_enabled(Mechanism.SAMPLING_MODES)
    modes = frozenset[str]()
    if is_chosen:
        found = _find_nearby_modes(problem, start, MULTI_START.far_chi2)
        if found is None and (near := find_near_point(problem, start)) is not None:
            found, start = _find_nearby_modes(problem, near, SEARCH.near_chi2), near
        modes = found or modes
    other = modes ^ frozenset(SPEEDS)
    return start, select_modes(problem, modes), select_modes(problem, other)


def _far_apart(problem: DualClutchProblem) -> frozenset[str]:
    """Return the outputs of which half a period is nearly a delay of the inputs, beyond the reach
    of an expansion: the speeds of a log without an output torque.

    That moves P0 and the delay of the engine torque by many standard deviations.
    """
    return frozenset() if problem.terms[0].compares(OUTPUT_TORQUE) else frozenset(SPEEDS)


def _find_nearby_modes(
    problem: DualClutchProblem, point: ParameterVector, most: float
) -> frozenset[str] | None:
    """The modes that promise least from `point`; None where Q per sample is above `most` there."""
    weighted = problem.update_weighting(point)
    normal = weighted.normal(point)
    if normal is None or normal.cost > most * problem.size:
        return None
    return _promising(weighted, point, normal)


def refit_best_mode(problem: DualClutchProblem, best: LikelihoodFit) -> LikelihoodFit:
    """The fit with every signal of the likeliest mode.

    `problem` has signals as read, `best` is its fit with some modes. Without an output torque half
    a period of all speeds is a delay of the engine torque, too far away for an expansion to tell
    which it is: there the other mode of speeds is tried.
    """

    tried = {get_modes(best.problem)}

    def better_of(
        one: LikelihoodFit, modes: frozenset[str], start: ParameterVector
    ) -> LikelihoodFit:
        if modes in tried:
            return one
        tried.add(modes)
        other = _nearby(select_modes(problem, modes), one, start)
        return one if other is None or _rise(problem, one, other) >= 0.0 else other

    for _ in range(ROUNDS):
        promising = _promising(best.problem, best.point, best.normal)
        known, best = best, better_of(best, promising, best.point)
        if best is known:
            break
    if problem.terms[0].compares(OUTPUT_TORQUE):
        return best
    return better_of(
        best, get_modes(best.problem) ^ frozenset(SPEEDS), _start_of_other_outputs(best)
    )


def widen_over_modes(
    problem: DualClutchProblem, best: LikelihoodFit
) -> tuple[LikelihoodFit, list[Finding]]:
    """The fit with its covariance widened up to the minimum that has the outputs which lie
    `_far_apart` of the other mode, and a finding; as it is where the deviance rises to there by
    more than a tie of both, and than its spread over logs explains."""
    outputs = _far_apart(problem) & _shown(problem)
    if not outputs:
        return best, []
    modes, start = get_modes(best.problem) ^ outputs, _start_of_other_outputs(best)
    try:
        other = fit_local(
            select_modes(problem, modes), start, WORSE * best.normal.cost / problem.size
        )
    except BudgetExceeded:  # nobody knows: what shows the same may be as good
        far = start.values - best.point.values
    else:
        if other is None:
            return best, []
        by_chance = Z95 * _estimate_rise_std(best, other)
        if _rise(problem, best, other) > TIE + by_chance:
            return best, []
        far = other.point.values - best.point.values
    names = ", ".join(name.replace("_", " ") for name in OUTPUTS if name in outputs)
    widened = replace(best, covariance=best.covariance + np.outer(far, far) / Z95**2)
    return widened, [report(Code.SAMPLING_UNCERTAIN, channels=names)]


def _start_of_other_outputs(best: LikelihoodFit) -> ParameterVector:
    """Build the initial point for the other sampling mode of the outputs: the minimum of `best`,
    with torque delays by which both modes give nearly the same samples."""
    values = best.point.values.copy()
    delays = {term.plant.get_unknown("te_delay"): term.record for term in best.problem.terms}
    for name, record in delays.items():
        if name in best.point.names:
            speed = next(out for out in record.outputs if out.name in SPEEDS)
            half = 0.5 * speed.get_period(record.time)
            values[best.point.names.index(name)] += half if speed.window == 0.0 else -half
    return best.point.replace_values(np.clip(values, best.problem.lower, best.problem.upper))


def _nearby(
    problem: DualClutchProblem, best: LikelihoodFit, start: ParameterVector
) -> LikelihoodFit | None:
    """The minimum from `start`; None where it is surely no better than `best`, of other modes, or
    not found with the work that is left."""
    try:
        return fit_local(problem, start, WORSE * best.normal.cost / problem.size)
    except BudgetExceeded:
        return None


def _rise(problem: DualClutchProblem, one: LikelihoodFit, other: LikelihoodFit) -> float:
    """Rise from `one` to the `other` of what modes compare by, with their prices: the deviance
    where all outputs are of the other mode, Q where not."""
    modes, others = get_modes(one.problem), get_modes(other.problem)
    prices = _price(problem, others) - _price(problem, modes)
    if _shown(problem) <= modes ^ others:
        return other.deviance - one.deviance + prices
    return other.normal.cost - one.normal.cost + prices


def _estimate_rise_std(one: LikelihoodFit, other: LikelihoodFit) -> float:
    """Estimate the standard deviation of the rise of Q from `one` to the `other` fit.

    That is the sum over the samples of what each adds, whose spread shows by how much another log
    of the same shifts would differ, whatever both models lack (Vuong 1989). Neighbours depend on
    each other, so that it is taken over the blocks of slow errors.
    """
    power = 0.0
    pairs = (zip(fit.problem.terms, fit.normal.residuals, strict=True) for fit in (one, other))
    for (term, mine), (against, its) in zip(*pairs, strict=True):
        rise = its * against.weighting.apply_inverse(its) - mine * term.weighting.apply_inverse(
            mine
        )
        for out, rows, _ in split_whitened(term, mine):
            _, means = compute_block_means(term.record.time[out.place], rise[rows])
            power += out.values.size * float(np.var(means))
    return float(np.sqrt(power))


def report_modes(modes: frozenset[str]) -> list[Finding]:
    """Report the signals that are not as read."""
    means = ", ".join(name.replace("_", " ") for name in OUTPUTS if name in modes)
    return [report(Code.MEAN_SAMPLES, channels=means)] if means else []


def _promising(
    problem: DualClutchProblem, point: ParameterVector, normal: NormalEquations
) -> frozenset[str]:
    """Names of the signals that are better taken for something else than read."""
    choices = _choices(problem, point, normal)
    return _flipped(get_modes(problem), choices.flips[int(np.argmin(choices.left))])


def _flipped(modes: frozenset[str], flips: FloatArray) -> frozenset[str]:
    """The modes with those of `SIGNALS` changed whose flip (m,) is 1."""
    return modes ^ {name for name, flip in zip(SIGNALS, flips, strict=True) if flip}


def _price(problem: DualClutchProblem, modes: frozenset[str]) -> float:
    """Compute the penalty of modes other than read: twice the logarithm of the odds against
    them."""
    speeds = _shown(problem).intersection(SPEEDS)
    means = len(modes & speeds)
    common = int(means > 0) + int(TORQUE in modes)
    rare = min(means, len(speeds) - means) + int("output_torque" in modes)
    return COMMON_PRICE * common + RARE_PRICE * rare


def _shown(problem: DualClutchProblem) -> frozenset[str]:
    """Names of the outputs that the log holds."""
    return frozenset(out.name for term in problem.terms for out in term.record.outputs)


@dataclass(frozen=True, eq=False)
class _Choices:
    """Every way to take the signals, the one at hand first: `flips` (q, m) of `SIGNALS` are 1 where
    one is of the other mode than now, `left` (q,) is what modes compare by with their price,
    less a constant."""

    flips: FloatArray
    left: FloatArray


def _choices(
    problem: DualClutchProblem,
    point: ParameterVector,
    normal: NormalEquations,
) -> _Choices:
    """Expand Q at `point` over all choices by `normal`, with the weighting there."""
    changes = [_changes(term, point) for term in problem.terms]
    score = compute_column_products(problem, normal, changes)
    shown = {*_shown(problem), TORQUE} if is_enabled(Mechanism.SAMPLING_MODES) else set()
    flips = np.array(list(product(*((0.0, 1.0) if n in shown else (0.0,) for n in SIGNALS))))
    gradients = normal.gradient + flips @ score.cross.T
    steps = np.array([solve_step(normal.information, one) for one in gradients])
    price = np.array([_price(problem, _flipped(get_modes(problem), row)) for row in flips])
    followed = np.sum(gradients * steps, axis=1)
    before = np.sum((flips @ score.own) * flips, axis=1) - 2.0 * flips @ score.pull
    return _Choices(flips, before + followed + price)


def _changes(term: DualClutchTerm, point: ParameterVector) -> FloatArray:
    """Compute the change (n, m) of a run by the other mode of each of `SIGNALS`, one column
    each."""
    record = term.record
    columns = term.show(point, term.build_task(point).simulate().columns)
    found, first = np.zeros((record.size, len(SIGNALS))), 0
    for out in record.outputs:
        rows = slice(first, first + out.values.size)
        first = rows.stop
        column = columns[out.name]
        change = out.sample_other_mode(record.time, column) - out.sample(record.time, column)
        found[rows, SIGNALS.index(out.name)] = change
    bend = record.interpolate_bend(term.plant.get_value(point, "te_delay"))
    sign = -1.0 if record.curved else 1.0
    answer = term.observe(term.compute_response(point), {TORQUE: sign * bend})
    if np.all(np.isfinite(answer)):  # an unstable run has no finite response
        found[:, -1] = answer
    return found
