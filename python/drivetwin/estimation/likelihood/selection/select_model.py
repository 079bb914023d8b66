# SPDX-License-Identifier: MIT
"""Model selection by the log: growth and variation of the load, sampling mode of the outputs.

A term of the model that is wrongly left out biases everything (a load that grows with speed moves
J3 by several per cent), and one that is wrongly left in widens intervals. The log decides by its
evidence (candidates.py). Outputs are samples or means, whichever gives the smaller residual
(sampling_mode.py).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import TimedStages
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import KnownDriveline, ShiftSignals
from drivetwin.estimation.direct.load_balance import AERO
from drivetwin.estimation.likelihood.effects.shaft import ROUNDING
from drivetwin.estimation.likelihood.fit import LikelihoodFit, PlantEvidence, locate_bounds
from drivetwin.estimation.likelihood.mechanism import Mechanism, is_enabled
from drivetwin.estimation.likelihood.multistart import (
    MULTI_START,
    NoConvergence,
    compute_spread,
    fit_local,
    fit_multistart,
    is_doubtful,
    refine,
    scan_shaft,
)
from drivetwin.estimation.likelihood.parametrization import DualClutchProblem
from drivetwin.estimation.likelihood.priors import build_problem
from drivetwin.estimation.likelihood.selection.candidates import (
    GROWING_LOAD,
    LOAD_OF_EACH_SHIFT,
    find_absent_terms,
)
from drivetwin.estimation.likelihood.selection.plants import (
    compare_plants,
    drop_effect,
    extend_problem,
)
from drivetwin.estimation.likelihood.selection.sampling_mode import (
    get_modes,
    refit_best_mode,
    report_modes,
    select_modes,
    select_sampling_mode,
    widen_over_modes,
)
from drivetwin.estimation.likelihood.torque_record import OUTPUT_TORQUE
from drivetwin.estimation.result.estimate_set import report_growth
from drivetwin.findings import Finding
from drivetwin.likelihood.budget import MAX_REFIT_WORK, BudgetExceeded, limit_evaluations
from drivetwin.likelihood.covariance import compute_covariance
from drivetwin.likelihood.gauss_newton import minimise
from drivetwin.likelihood.point import ParameterVector
from drivetwin.likelihood.search import find_best_draw
from drivetwin.simulation.dual_clutch import LossLaw
from drivetwin.vehicle.effects import EffectId
from drivetwin.vehicle.spec import PriorValue


@dataclass(frozen=True)
class SelectionSettings:
    """Settings of the model selection; work is counted in passes over the log."""

    max_work: float = 2000.0
    """Work of the search: three rounds from draws. A fit that succeeds takes 100 to 800, in one of
    a hundred made logs up to 2,000; beyond, an element is missing or the card is wrong [passes]."""
    max_restricted_work: float = MAX_REFIT_WORK
    """Work of the search that starts from a minimum of the wider model: it takes 160 passes
    [passes]."""
    min_aero: float = 1e-3
    """Initial growing part of the load; at zero it has no derivative [N m s^2/rad^2]."""


SELECTION = SelectionSettings()
LEVEL = "mu_c"
"""Coefficient of a friction law by which draws scale it."""
_STAGES = TimedStages(
    "model selection",
    ("search", "bounds", "restriction", "other outputs"),
)


def select_model(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    loss_law: LossLaw,
    guess: Mapping[str, float],
) -> tuple[LikelihoodFit, tuple[Finding, ...]]:
    """Fit the variant that the log supports; return the decisions as findings.

    Raises IdentificationError where no variant converges.
    """
    growing = {**guess, AERO: max(guess.get(AERO, 0.0), SELECTION.min_aero)}
    constant = {name: value for name, value in guess.items() if name != AERO}
    first = growing if is_enabled(Mechanism.LOAD_GROWTH) else constant
    problem, start = build_problem(signals, drivelines, loss_law, first, hilly=True)
    with _STAGES.enter("search"), limit_evaluations(SELECTION.max_work) as search:
        best = fit_candidates(problem, start)
    with _STAGES.enter("bounds"), limit_evaluations(min(MAX_REFIT_WORK, search.left)):
        best = retry_from_card(problem, best)
    with _STAGES.enter("restriction"), limit_evaluations(SELECTION.max_restricted_work):
        is_chosen = is_enabled(Mechanism.LOAD_TERMS)
        absent, point = find_absent_terms(best) if is_chosen else ([], best.point)
        guess = constant if GROWING_LOAD in absent else growing
        hilly = LOAD_OF_EACH_SHIFT not in absent
        narrower = build_problem(signals, drivelines, loss_law, guess, hilly=hilly)
        best, problem = _restrict(best, point, narrower) or (best, problem)
    notes = _report_growth(best)
    with _STAGES.enter("other outputs"), limit_evaluations(MAX_REFIT_WORK):
        best, either = widen_over_modes(problem, best)
    return best, (
        *notes,
        *report_modes(get_modes(best.problem)),
        *either,
    )


def _restrict(
    wider: LikelihoodFit,
    point: ParameterVector,
    narrower: tuple[DualClutchProblem, ParameterVector],
) -> tuple[LikelihoodFit, DualClutchProblem] | None:
    """Fit the model without the effects that the log does not show, and return its problem.

    Returns None if the log shows all effects, or if the work runs out: the wider model is correct
    all the same.
    """
    problem, start = narrower
    left_out = [name for name in wider.point.names if name not in start.names]
    if not left_out:
        return None
    if left_out == [AERO] and wider.point[AERO] == 0.0:
        return _drop_unknown(wider, problem, AERO), problem
    try:
        of_modes = select_modes(problem, get_modes(wider.problem))
        return fit_multistart(of_modes, _copy_values(start, point), thorough=False), problem
    except BudgetExceeded:
        return None


def fit_candidates(problem: DualClutchProblem, start: ParameterVector) -> LikelihoodFit:
    """Fit with every signal in its likeliest sampling mode.

    Raises IdentificationError where it does not converge with the likeliest modes.
    """
    start = scan_shaft(problem, start)
    near, likely, other = select_sampling_mode(problem, start)
    draws = near is start or not is_doubtful(problem, near)
    best = _try_fit(likely, near, draws) or fit_multistart(other, near, draws=draws)
    best = refit_best_mode(problem, best)
    if best.chi2 < MULTI_START.accept_chi2:
        return best
    second = refine(best, select_modes(problem, get_modes(best.problem)), near)
    return best if second is best else refit_best_mode(problem, second)


def fit_with_backlash(
    problem: DualClutchProblem, start: ParameterVector, priors: Sequence[PriorValue]
) -> LikelihoodFit | None:
    """Fit with backlash in the plant; None without a reversal of the torque or a minimum.

    Crossing the gap moves the whole oscillation of the shaft, so that the dual clutch may reach no
    minimum at all. `problem` is that of the dual clutch with signals as read, `priors` are those of
    the unknowns of the gap.
    """
    if not _is_reversed(problem):
        return None
    extended, point = extend_problem(problem, start, EffectId.BACKLASH, priors)
    try:
        with limit_evaluations(SELECTION.max_work):
            found = fit_candidates(extended, point)
    except IdentificationError:
        return None
    return replace(found, plant=_compare(found, priors))


def _is_reversed(problem: DualClutchProblem) -> bool:
    """Return whether the measured output torque goes to either side of zero, beyond the rounding
    of its sign."""
    outputs = [out for term in problem.terms for out in term.record.outputs]
    torques = [out.values for out in outputs if out.name == OUTPUT_TORQUE]
    if not torques:
        return False
    low, high = min(map(np.min, torques)), max(map(np.max, torques))
    least = ROUNDING * max(abs(low), abs(high))
    return bool(low < -least and high > least)


def _compare(found: LikelihoodFit, priors: Sequence[PriorValue]) -> PlantEvidence:
    """Compare a fit with the dual clutch, sought from the same unknowns with the same weighting.

    Where that cannot be simulated it counts as far as a search may be from the measurement.
    """
    plain = drop_effect(found.problem)
    count = plain.lower.size
    start = ParameterVector(found.point.names[:count], found.point.values[:count])
    other = minimise(plain, start)
    if other is None:
        nats = 0.5 * (MULTI_START.far_chi2 * found.problem.size - found.normal.cost)
        return PlantEvidence(EffectId.BACKLASH, nats, np.zeros_like(found.point.values), count)
    return compare_plants(other, found, EffectId.BACKLASH, found.chi2, priors)


def retry_from_card(problem: DualClutchProblem, best: LikelihoodFit) -> LikelihoodFit:
    """Fit again from the card's P0 where a P0 has ended at a bound; return the better fit.

    Beyond the valley between two minima, P0 and the friction level compensate for each other. The
    levels are sought anew by draws.
    """
    ended = np.logical_or(*locate_bounds(best)) & (np.diag(problem.prior.precision) > 0.0)
    names = best.point.names
    fills = [k for k, name in enumerate(names) if name.endswith(".P0") and ended[k]]
    if not fills:
        return best
    values = best.point.values.copy()
    values[fills] = problem.prior.mean[fills]
    problem, start = (
        select_modes(problem, get_modes(best.problem)),
        best.point.replace_values(values),
    )
    is_level = np.array([name.endswith(f".{LEVEL}") for name in names])
    try:
        spread = np.where(is_level, compute_spread(problem, start), 0.0)
        found = fit_local(problem, find_best_draw(problem, start, spread))
    except BudgetExceeded:
        return best
    return best if found is None or found.chi2 >= best.chi2 else found


def _try_fit(
    problem: DualClutchProblem, start: ParameterVector, draws: bool
) -> LikelihoodFit | None:
    """Fit up to the first plausible minimum; None if there is none.

    Raises NoConvergence where none is near.
    """
    try:
        return fit_multistart(problem, start, thorough=False, draws=draws)
    except NoConvergence:
        raise
    except IdentificationError:
        return None


def _copy_values(start: ParameterVector, found: ParameterVector) -> ParameterVector:
    """Copy the values of `found` into `start` for the names that it has."""
    values = [found[n] if n in found.names else start[n] for n in start.names]
    return start.replace_values(np.array(values))


def _report_growth(best: LikelihoodFit) -> list[Finding]:
    """Report a load that grows with speed; empty if it does not."""
    if AERO not in best.point.names:
        return []
    k = best.point.names.index(AERO)
    std = float(np.sqrt(best.covariance[k, k]))
    return [report_growth(best.point[AERO], std, best.problem.terms[0].plant.mean_speed)]


def _drop_unknown(best: LikelihoodFit, narrower: DualClutchProblem, name: str) -> LikelihoodFit:
    """Return the fit of the model without an unknown, where that of the wider one has zero for it.

    It is the same minimum. An unknown at its bound has no place in the covariance: it would widen
    the interval of T_v/i_f, with which the growth of the load nearly goes, by what it cannot be.
    """
    k = best.point.names.index(name)
    point, normal = _drop_value(best.point, k), best.normal
    terms = [
        replace(term, plant=other.plant)
        for term, other in zip(best.problem.terms, narrower.terms, strict=True)
    ]
    normal = replace(
        normal,
        gradient=np.delete(normal.gradient, k),
        information=_drop_row(normal.information, k),
        data=_drop_row(normal.data, k),
        regressors=tuple(np.delete(one, k, axis=1) for one in normal.regressors),
        slopes=tuple(np.delete(one, k, axis=1) for one in normal.slopes),
    )
    problem = replace(narrower, terms=tuple(terms))
    return replace(
        best,
        problem=problem,
        point=point,
        covariance=compute_covariance(problem, normal, best.chi2),
        normal=normal,
    )


def _drop_value(point: ParameterVector, k: int) -> ParameterVector:
    """Return the point without its unknown number k."""
    return ParameterVector((*point.names[:k], *point.names[k + 1 :]), np.delete(point.values, k))


def _drop_row(matrix: FloatArray, k: int) -> FloatArray:
    """Return a matrix (p, p) without row and column k."""
    return np.delete(np.delete(matrix, k, axis=0), k, axis=1)
