# SPDX-License-Identifier: MIT
"""What the log itself decides about the model: how the load grows, what slow speeds show.

A part of the model that is wrongly left out biases everything (a load that grows with speed moves
J3 by several per cent), and one that is wrongly left in widens intervals. The growing part is
kept where it is significant; what slow speeds show is the variant that leaves less.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from drivetwin.driveline import LossLaw
from drivetwin.errors import IdentificationError
from drivetwin.identify.likelihood.fit import LikelihoodFit, fit, nearest
from drivetwin.identify.likelihood.newton import minimise
from drivetwin.identify.likelihood.priors import problem_of
from drivetwin.identify.likelihood.problem import Problem
from drivetwin.identify.likelihood.unknowns import AERO, Point
from drivetwin.identify.signals import Driveline, ShiftSignals
from drivetwin.progress import part
from drivetwin.shifts.shift import Shift

SIGNIFICANT = 3.0
"""Size of the growing part of the load, in its standard deviations, from which it is kept."""

PLAINLY = 1.2
"""Q of the other kind over that of the best from which on it is given up."""
SMALL = 1e-3
"""Growing part of the load [N m s^2/rad^2] to start from: one that is zero has no derivative."""


def choose(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[Driveline],
    loss_law: LossLaw,
    guess: Mapping[str, float],
) -> tuple[LikelihoodFit, tuple[str, ...]]:
    """The fit of the variant that the log speaks for, and what was decided, in words.

    Raises IdentificationError where no variant converges.
    """
    shifts = [s.shift for s in signals]
    problem, start = problem_of(signals, drivelines, loss_law, {**guess, AERO: SMALL})
    notes = []
    with part(0.0, 0.6):
        best, means = _fit_either(problem, start, shifts)
    with part(0.6, 1.0):
        if _grows(best):
            notes.append(_growth(best))
        else:
            problem, start = problem_of(signals, drivelines, loss_law, guess)
            problem = problem.averaged() if means else problem
            best = fit(problem, _taken(start, best.point), shifts)
    if means:
        notes.append("slow speeds are taken as means over their period: that fits better")
    return best, tuple(notes)


def _fit_either(
    problem: Problem, start: Point, shifts: Sequence[Shift]
) -> tuple[LikelihoodFit, bool]:
    """The fit that leaves less, and whether slow speeds are means over their period in it.

    Raises IdentificationError where neither converges.
    """
    if not problem.slow:
        return fit(problem, start, shifts), False
    kinds = {False: problem, True: problem.averaged()}
    likely = min(kinds, key=lambda means: kinds[means].cost(start) / kinds[means].size)
    best = _tried(kinds[likely], start, shifts)
    if best is None:
        return fit(kinds[not likely], start, shifts), not likely
    other = _other(kinds[not likely], best)
    if other is not None and other.chi2 < best.chi2:
        return other, not likely
    return best, likely


def _other(problem: Problem, best: LikelihoodFit) -> LikelihoodFit | None:
    """The fit of the other kind from the point of the `best`; None where it is plainly worse.

    A model that does not fit may creep for as long as a search lasts, so a rough one decides.
    """
    rough = minimise(problem, best.point, lambda _, at: problem.weighted_by(at), rough=True)
    if rough is None or rough.normal.cost > PLAINLY * best.normal.cost:
        return None
    return nearest(problem, rough.point)


def _tried(problem: Problem, start: Point, shifts: Sequence[Shift]) -> LikelihoodFit | None:
    """The first plausible minimum; None where there is none."""
    try:
        return fit(problem, start, shifts, thorough=False)
    except IdentificationError:
        return None


def _grows(best: LikelihoodFit) -> bool:
    """Whether the growing part of the load differs from none by more than its noise."""
    k = best.point.names.index(AERO)
    return bool(best.point[AERO] > SIGNIFICANT * np.sqrt(best.covariance[k, k]))


def _growth(best: LikelihoodFit) -> str:
    """What is said of a load that grows with speed."""
    k = best.point.names.index(AERO)
    half = 1.96 * float(np.sqrt(best.covariance[k, k]))
    speed = best.problem.parts[0].structure.mean_speed
    return (
        f"the load grows with the square of the speed ({best.point[AERO]:.2g} ± {half:.1g} "
        f"N m s^2/rad^2 at the wheel); T_v/i_f holds at {speed:.3g} rad/s of the wheel"
    )


def _taken(start: Point, found: Point) -> Point:
    """`start` with the values of `found` where it has them."""
    values = [found[n] if n in found.names else start[n] for n in start.names]
    return start.moved(np.array(values))
