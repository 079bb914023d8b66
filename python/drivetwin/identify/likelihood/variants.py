# SPDX-License-Identifier: MIT
"""Model selection by the log: growth and variation of the load, sampling mode of the outputs.

A part of the model that is wrongly left out biases everything (a load that grows with speed moves
J3 by several per cent), and one that is wrongly left in widens intervals. The growing part is
kept where it is significant and allowed for where it is not (growth.py), a load for each shift
unless all may be one (hills.py); outputs are samples or means, whichever leaves less.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.driveline import LossLaw
from drivetwin.errors import IdentificationError
from drivetwin.identify.likelihood import growth
from drivetwin.identify.likelihood.fit import (
    MULTI_START,
    Hopeless,
    LikelihoodFit,
    checked,
    fit,
)
from drivetwin.identify.likelihood.hills import with_one_load
from drivetwin.identify.likelihood.kinds import (
    averaged_over_kinds,
    in_words,
    likely_kinds,
    with_best_kinds,
    with_either_kind,
    with_slow_outputs,
)
from drivetwin.identify.likelihood.lingering import lowest
from drivetwin.identify.likelihood.priors import problem_of
from drivetwin.identify.likelihood.problem import Problem
from drivetwin.identify.likelihood.unknowns import AERO
from drivetwin.identify.likelihood.work import OutOfWork, at_most
from drivetwin.identify.optimize.objective import Point
from drivetwin.identify.signals import Driveline, ShiftSignals
from drivetwin.progress import part
from drivetwin.shifts.shift import Shift


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


def choose(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[Driveline],
    loss_law: LossLaw,
    guess: Mapping[str, float],
) -> tuple[LikelihoodFit, tuple[str, ...]]:
    """Fit the variant that the log supports; return the decisions as sentences.

    Raises IdentificationError where no variant converges.
    """
    shifts = [s.shift for s in signals]
    growing = {**guess, AERO: max(guess.get(AERO, 0.0), SELECTION.min_aero)}
    constant = {name: value for name, value in guess.items() if name != AERO}
    problem, start = problem_of(signals, drivelines, loss_law, growing, hilly=True)
    with part(0.0, 0.45), at_most(SELECTION.max_work) as search:
        best = _fit_either(problem, start, shifts)
    with part(0.45, 0.5, "kinds of signals"), at_most(SELECTION.max_sampling_mode_work):
        best = with_slow_outputs(problem, best)
    with part(0.5, 0.65), at_most(SELECTION.max_restricted_work):
        level = with_one_load(best)
        point, covariance = level or (best.point, best.covariance)
        guess = growing if growth.grows(point, covariance) else constant
        narrower = problem_of(signals, drivelines, loss_law, guess, hilly=level is None)
        wider = best
        best, problem = _narrowed(best, point, narrower, shifts) or (best, problem)
    notes = growth.told(best)
    with (
        part(0.65, 0.85, "other minima"),
        at_most(min(SELECTION.max_touch_point_work, search.left)),
    ):
        best = lowest(problem, best)
    with (
        part(0.85, 1.0, "kinds of signals"),
        at_most(min(SELECTION.max_sampling_mode_work, search.left)),
    ):
        best, doubts = averaged_over_kinds(problem, best)
    with at_most(SELECTION.max_sampling_mode_work):
        best, either = with_either_kind(problem, best)
    if AERO not in best.point.names:
        best = growth.allowed_for(best, wider)
    return best, (*notes, *in_words(best.problem.kinds), *dict.fromkeys((*doubts, *either)))


def _narrowed(
    wider: LikelihoodFit, point: Point, narrower: tuple[Problem, Point], shifts: Sequence[Shift]
) -> tuple[LikelihoodFit, Problem] | None:
    """Fit the model without the effects that the log does not show, and return its problem.

    Returns None if the log shows all effects, or if the work runs out: the wider model is correct
    all the same.
    """
    problem, start = narrower
    left_out = [name for name in wider.point.names if name not in start.names]
    if not left_out:
        return None
    if left_out == [AERO] and wider.point[AERO] == 0.0:
        return growth.without(wider, problem), problem
    try:
        of_kinds = problem.of_kinds(wider.problem.kinds)
        return fit(of_kinds, _taken(start, point), shifts, thorough=False), problem
    except OutOfWork:
        return None


def _fit_either(problem: Problem, start: Point, shifts: Sequence[Shift]) -> LikelihoodFit:
    """Fit with every signal in its likeliest sampling mode.

    Raises IdentificationError where it does not converge with the likeliest kinds.
    """
    likely, other = likely_kinds(problem, start, shifts)
    best = _tried(likely, start, shifts) or fit(
        other, start, shifts, restarts=MULTI_START.shaft_factors[:1]
    )
    best = with_best_kinds(problem, best)
    if best.chi2 < MULTI_START.accept_chi2:
        return best
    second = checked(best, problem.of_kinds(best.problem.kinds), start, shifts)
    return best if second is best else with_best_kinds(problem, second)


def _tried(problem: Problem, start: Point, shifts: Sequence[Shift]) -> LikelihoodFit | None:
    """Fit up to the first plausible minimum; None if there is none.

    Raises Hopeless where none is near.
    """
    try:
        return fit(problem, start, shifts, thorough=False)
    except Hopeless:
        raise
    except IdentificationError:
        return None


def _taken(start: Point, found: Point) -> Point:
    """Copy the values of `found` into `start` for the names that it has."""
    values = [found[n] if n in found.names else start[n] for n in start.names]
    return start.moved(np.array(values))
