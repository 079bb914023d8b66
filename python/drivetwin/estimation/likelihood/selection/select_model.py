# SPDX-License-Identifier: MIT
"""Model selection by the log: growth and variation of the load, sampling mode of the outputs.

A part of the model that is wrongly left out biases everything (a load that grows with speed moves
J3 by several per cent), and one that is wrongly left in widens intervals. The growing part is
kept where it is significant (aero_load.py); where it is not, the effect of that name widens the
intervals. Each shift has its own load unless one common load is consistent (per_shift_load.py).
Outputs are samples or means, whichever gives the smaller residual (sampling_mode.py).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._util.timed_stages import TimedStages
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import KnownDriveline, ShiftSignals
from drivetwin.estimation.likelihood.budget import BudgetExceeded, limit_evaluations
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.effects.expansion import expand_effects
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.optimize.multistart import (
    MULTI_START,
    NoConvergence,
    fit_multistart,
    refine,
)
from drivetwin.estimation.likelihood.priors import build_problem
from drivetwin.estimation.likelihood.selection import aero_load
from drivetwin.estimation.likelihood.selection.per_shift_load import fit_common_load
from drivetwin.estimation.likelihood.selection.sampling_mode import (
    average_modes,
    refit_best_mode,
    refit_mode_beside,
    refit_slow_outputs,
    report_modes,
    select_sampling_mode,
    widen_over_modes,
)
from drivetwin.estimation.likelihood.selection.touch_point_minima import find_best_minimum
from drivetwin.estimation.likelihood.shift_objective import ShiftObjective
from drivetwin.estimation.linear.load_balance import AERO
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.findings import Finding
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.dual_clutch import LossLaw


@dataclass(frozen=True)
class SelectionSettings:
    """Settings of the model selection; work is counted in passes over the log."""

    max_work: float = 700.0
    """Work of the search: one from a bad start takes 450 passes [passes]."""
    max_restricted_work: float = 200.0
    """Work of the search that starts from a minimum of the wider model: it takes 160 passes
    [passes]."""
    max_touch_point_work: float = 400.0
    """Work on other minima of an element that stays about P0, at most what the search has left:
    each takes about 100 passes [passes]."""
    max_sampling_mode_work: float = 400.0
    """Work on sampling modes that the log hardly distinguishes, at most what the search has left:
    each takes about 100 passes [passes]."""
    min_aero: float = 1e-3
    """Initial growing part of the load; at zero it has no derivative [N m s^2/rad^2]."""


SELECTION = SelectionSettings()
_STAGES = TimedStages(
    "model selection",
    ("search", "slow outputs", "restriction", "minima", "averaging", "other outputs"),
)


def select_model(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    loss_law: LossLaw,
    guess: Mapping[str, float],
    priors: EffectPriors,
) -> tuple[LikelihoodFit, tuple[Finding, ...]]:
    """Fit the variant that the log supports; return the decisions as findings.

    Sampling modes are chosen beside the effects that the log shows, with their `priors`.

    Raises IdentificationError where no variant converges.
    """
    shifts = [s.shift for s in signals]
    growing = {**guess, AERO: max(guess.get(AERO, 0.0), SELECTION.min_aero)}
    constant = {name: value for name, value in guess.items() if name != AERO}
    problem, start = build_problem(signals, drivelines, loss_law, growing, hilly=True)
    with _STAGES.enter("search"), limit_evaluations(SELECTION.max_work) as search:
        best = fit_candidates(problem, start, shifts)
    with (
        _STAGES.enter("slow outputs", "kinds of signals"),
        limit_evaluations(SELECTION.max_sampling_mode_work),
    ):
        best = refit_slow_outputs(problem, best)
    with _STAGES.enter("restriction"), limit_evaluations(SELECTION.max_restricted_work):
        level = fit_common_load(best)
        point, covariance = level or (best.point, best.covariance)
        guess = growing if aero_load.is_significant(point, covariance) else constant
        narrower = build_problem(signals, drivelines, loss_law, guess, hilly=level is None)
        best, problem = _restrict(best, point, narrower, shifts) or (best, problem)
    notes = aero_load.report_aero_load(best)
    with (
        _STAGES.enter("minima", "other minima"),
        limit_evaluations(min(SELECTION.max_touch_point_work, search.left)),
    ):
        best = find_best_minimum(problem, best)
    with (
        _STAGES.enter("averaging", "kinds of signals"),
        limit_evaluations(min(SELECTION.max_sampling_mode_work, search.left)),
    ):
        best, doubts = _average_modes(problem, best, priors)
    with _STAGES.enter("other outputs"), limit_evaluations(SELECTION.max_sampling_mode_work):
        best, either = widen_over_modes(problem, best)
    return best, (*notes, *report_modes(best.problem.kinds), *dict.fromkeys((*doubts, *either)))


def _average_modes(
    problem: ShiftObjective, best: LikelihoodFit, priors: EffectPriors
) -> tuple[LikelihoodFit, list[Finding]]:
    """Average over sampling modes, with the effects that the log shows as further unknowns."""
    found = expand_effects(best, priors)
    if found is None or not any(group.effect for group in found.shown):
        return average_modes(problem, best)
    other = refit_mode_beside(problem, best, found.sums)
    if other is not best:
        best, found = other, expand_effects(other, priors)
    return average_modes(problem, best, None if found is None else found.sums)


def _restrict(
    wider: LikelihoodFit,
    point: ParameterVector,
    narrower: tuple[ShiftObjective, ParameterVector],
    shifts: Sequence[Shift],
) -> tuple[LikelihoodFit, ShiftObjective] | None:
    """Fit the model without the effects that the log does not show, and return its problem.

    Returns None if the log shows all effects, or if the work runs out: the wider model is correct
    all the same.
    """
    problem, start = narrower
    left_out = [name for name in wider.point.names if name not in start.names]
    if not left_out:
        return None
    if left_out == [AERO] and wider.point[AERO] == 0.0:
        return aero_load.drop_growth(wider, problem), problem
    try:
        of_kinds = problem.select_modes(wider.problem.kinds)
        return fit_multistart(of_kinds, _copy_values(start, point), shifts, thorough=False), problem
    except BudgetExceeded:
        return None


def fit_candidates(
    problem: ShiftObjective, start: ParameterVector, shifts: Sequence[Shift]
) -> LikelihoodFit:
    """Fit with every signal in its likeliest sampling mode.

    Raises IdentificationError where it does not converge with the likeliest kinds.
    """
    likely, other = select_sampling_mode(problem, start, shifts)
    best = _try_fit(likely, start, shifts) or fit_multistart(
        other, start, shifts, restarts=MULTI_START.shaft_factors[:1]
    )
    best = refit_best_mode(problem, best)
    if best.chi2 < MULTI_START.accept_chi2:
        return best
    second = refine(best, problem.select_modes(best.problem.kinds), start, shifts)
    return best if second is best else refit_best_mode(problem, second)


def _try_fit(
    problem: ShiftObjective, start: ParameterVector, shifts: Sequence[Shift]
) -> LikelihoodFit | None:
    """Fit up to the first plausible minimum; None if there is none.

    Raises NoConvergence where none is near.
    """
    try:
        return fit_multistart(problem, start, shifts, thorough=False)
    except NoConvergence:
        raise
    except IdentificationError:
        return None


def _copy_values(start: ParameterVector, found: ParameterVector) -> ParameterVector:
    """Copy the values of `found` into `start` for the names that it has."""
    values = [found[n] if n in found.names else start[n] for n in start.names]
    return start.replace_values(np.array(values))
