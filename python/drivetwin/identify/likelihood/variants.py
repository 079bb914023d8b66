# SPDX-License-Identifier: MIT
"""What the log itself decides about the model: how the load grows, what slow speeds show.

A part of the model that is wrongly left out biases everything (a load that grows with speed moves
J3 by several per cent), and one that is wrongly left in widens intervals. Each variant is fitted,
and kept where it leaves less.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from drivetwin.driveline import LossLaw
from drivetwin.identify.likelihood.fit import LikelihoodFit, fit
from drivetwin.identify.likelihood.priors import problem_of
from drivetwin.identify.likelihood.unknowns import AERO, Point
from drivetwin.identify.signals import Driveline, ShiftSignals

SIGNIFICANT = 3.0
"""Size of the growing part of the load, in its standard deviations, from which it is kept."""


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
    problem, start = problem_of(signals, drivelines, loss_law, {**guess, AERO: 0.0})
    best = fit(problem, start, shifts)
    notes = []
    index = best.point.names.index(AERO)
    std = float(np.sqrt(best.covariance[index, index]))
    if abs(best.point[AERO]) < SIGNIFICANT * std:
        problem, start = problem_of(signals, drivelines, loss_law, guess)
        best = fit(problem, _taken(start, best.point), shifts)
    else:
        speed = problem.parts[0].structure.mean_speed
        notes.append(
            f"the load grows with the square of the speed ({best.point[AERO]:.2g} ± "
            f"{1.96 * std:.1g} N m s^2/rad^2 at the wheel); T_v/i_f holds at {speed:.3g} rad/s"
        )
    if problem.slow:
        means = fit(problem.averaged(), best.point, shifts)
        if means.chi2 < best.chi2:
            best = means
            notes.append("slow speeds are taken as means over their period: that fits better")
    return best, tuple(notes)


def _taken(start: Point, found: Point) -> Point:
    """`start` with the values of `found` where it has them."""
    values = [found[n] if n in found.names else start[n] for n in start.names]
    return start.moved(np.array(values))
