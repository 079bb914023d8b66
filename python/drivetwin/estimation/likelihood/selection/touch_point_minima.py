# SPDX-License-Identifier: MIT
"""Minima of Q where an element that lets go lingers about P0, and which of them to take.

Held a few kPa above P0 an open element still drags; a little higher a P0 takes that torque away,
and from there Q hardly tells the way back: noise opens and closes the element, and Q has a minimum
on either side. Which of them a search ends in hangs on its start, the design value. So it is
started again from either side of where it ended.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from drivetwin._util.progress import scale_progress
from drivetwin.estimation.likelihood.budget import BudgetExceeded
from drivetwin.estimation.likelihood.data.input_smoothing import SMOOTHING
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.optimize.multistart import fit_local
from drivetwin.estimation.likelihood.selection.sampling_mode import TIE, WORSE
from drivetwin.estimation.likelihood.shift_objective import ShiftObjective, ShiftTerm
from drivetwin.estimation.likelihood.slip_contact import SLIPPING, evaluate_contact
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.estimation.result.estimate import Z95

LINGERS = 0.05
"""Time [s] that an element must slip about P0: one that just lets go passes in half of it."""


def find_best_minimum(problem: ShiftObjective, best: LikelihoodFit) -> LikelihoodFit:
    """The lowest of the minima about `best`, its covariance widened up to those that Q hardly tells
    from it. `problem` has signals as read.

    `best` itself where no element lingers about its P0.
    """
    minima = [best, *_others(problem, best)]
    found = min(minima, key=lambda one: one.normal.cost)
    tied = [one for one in minima if 0.0 < one.normal.cost - found.normal.cost < TIE]
    if not tied:
        return found
    moves = np.array([one.point.values - found.point.values for one in tied])
    std = np.sqrt(np.diag(found.covariance))
    far = moves[np.argmax(np.max(np.abs(moves) / std, axis=1))]
    return replace(found, covariance=found.covariance + np.outer(far, far) / Z95**2)


def _others(problem: ShiftObjective, best: LikelihoodFit) -> Iterator[LikelihoodFit]:
    """Minima found from either side of the P0 of each element that lingers about it."""
    problem = problem.select_modes(best.problem.kinds)
    most = WORSE * best.normal.cost / problem.size
    starts = []
    for name, away in _lingering(best).items():
        k = best.point.names.index(name)
        for side in (-away, away):
            values = best.point.values.copy()
            values[k] += side
            starts.append(best.point.replace_values(values))
    for done, start in enumerate(starts):
        try:
            with scale_progress(done / len(starts), (done + 1) / len(starts)):
                other = fit_local(problem, start, most)
        except BudgetExceeded:
            return
        if other is not None:
            yield other


def _lingering(best: LikelihoodFit) -> dict[str, float]:
    """P0 of off-going elements that slip about it, by the name of the unknown, each with the noise
    of a sample of its pressure [Pa]."""
    found = {}
    for part in best.problem.parts:
        leaving, _ = part.structure.elements
        name = f"{leaving.name}.P0"
        sigma = part.record.input_sigma.get(leaving.name, 0.0)
        if name in best.point.names and _time_about(part, best.point, leaving.name) > LINGERS:
            found[name] = sigma
    return found


def _time_about(part: ShiftTerm, point: ParameterVector, name: str) -> float:
    """Time [s] for which an element slips at a pressure that noise may lift above P0 or not."""
    run = part.simulate(point)
    if run is None or name not in part.record.pressures:
        return 0.0
    contact, signal = evaluate_contact(part, point, run, name), part.record.pressures[name]
    P0 = part.structure.get_value(point, f"{name}.P0")
    away = np.abs(np.interp(contact.middle, signal.time, signal.values) - P0)
    near = away < SMOOTHING.fill_sigma * part.record.input_sigma[name]
    return float(np.sum(np.diff(run.time)[near & (np.abs(contact.slip) > SLIPPING)]))
