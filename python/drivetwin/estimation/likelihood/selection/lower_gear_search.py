# SPDX-License-Identifier: MIT
"""Search from fits of the lower gear, for a log on which the usual search reaches no minimum.

The lower gear alone shows inertia, load and shaft whatever the friction, so it is fitted first with
each of the usual sampling modes; from the best of these the search goes on by stages. Where the
dual clutch reaches no minimum so either, backlash is put into the plant: crossing the gap moves the
whole oscillation of the shaft, and pedal steps before the shift show it alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drivetwin.estimation.likelihood.budget import BudgetExceeded, limit_evaluations
from drivetwin.estimation.likelihood.data.shift_record import OUTPUT_TORQUE
from drivetwin.estimation.likelihood.effects.shaft import ROUNDING
from drivetwin.estimation.likelihood.fit import LikelihoodFit, PlantEvidence
from drivetwin.estimation.likelihood.optimize.multistart import (
    MULTI_START,
    find_staged_start,
    fit_local,
    fit_lower_gear_only,
)
from drivetwin.estimation.likelihood.selection.plants import (
    compare_plants,
    extend_problem,
    list_starts,
)
from drivetwin.estimation.likelihood.selection.sampling_mode import SPEEDS, refit_best_mode
from drivetwin.estimation.likelihood.shift_objective import ShiftObjective
from drivetwin.estimation.optimize.gauss_newton import minimise
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.effects import EffectId
from drivetwin.vehicle.spec import PriorValue

MAX_WORK = 5000.0
"""Work of the search with one plant: it takes 600 for the dual clutch and 2500 with backlash
[passes]."""
MODES = (frozenset[str](), frozenset(SPEEDS), frozenset((*SPEEDS, OUTPUT_TORQUE)))
"""Sampling modes that are tried: as read, speeds as means, all outputs as means."""


def fit_from_lower_gear(
    problem: ShiftObjective, start: ParameterVector, shifts: Sequence[Shift]
) -> LikelihoodFit | None:
    """Fit the dual clutch; None where no sampling mode leads to a minimum. `problem` has signals as
    read."""
    return _search(problem, [start], shifts)


def fit_with_backlash(
    problem: ShiftObjective,
    start: ParameterVector,
    shifts: Sequence[Shift],
    priors: Sequence[PriorValue],
) -> LikelihoodFit | None:
    """Fit with backlash in the plant; None without a reversal of the torque or a minimum.

    `problem` is that of the dual clutch with signals as read, `priors` are those of the unknowns
    of the gap.
    """
    if not _is_reversed(problem):
        return None
    extended, point = extend_problem(problem, start, EffectId.BACKLASH, priors)
    starts = [np.append(start.values, one) for one in list_starts(EffectId.BACKLASH, priors[0])]
    found = _search(extended, [point.replace_values(one) for one in starts], shifts)
    return None if found is None else replace(found, plant=_compare(found, priors))


def _is_reversed(problem: ShiftObjective) -> bool:
    """Return whether the measured output torque goes to either side of zero, beyond the rounding
    of its sign."""
    outputs = [out for term in problem.terms for out in term.record.outputs]
    torques = [out.values for out in outputs if out.name == OUTPUT_TORQUE]
    if not torques:
        return False
    low, high = min(map(np.min, torques)), max(map(np.max, torques))
    least = ROUNDING * max(abs(low), abs(high))
    return bool(low < -least and high > least)


def _search(
    problem: ShiftObjective, starts: Sequence[ParameterVector], shifts: Sequence[Shift]
) -> LikelihoodFit | None:
    """Search from the fits of the lower gear, the best first; None where none leads to a minimum or
    the work runs out."""
    try:
        with limit_evaluations(MAX_WORK):
            for of_modes, point in _fit_lower_gears(problem, starts, shifts):
                near = find_staged_start(of_modes, point, shifts)
                found = None if near is None else fit_local(of_modes, near.point)
                if found is not None:
                    return refit_best_mode(problem, found)
    except BudgetExceeded:
        pass
    return None


def _fit_lower_gears(
    problem: ShiftObjective, starts: Sequence[ParameterVector], shifts: Sequence[Shift]
) -> list[tuple[ShiftObjective, ParameterVector]]:
    """Fit the lower gear with each sampling mode, from the best of the `starts`; best modes
    first."""
    found = []
    for modes in MODES:
        of_modes = problem.select_modes(modes)
        fits = [fit_lower_gear_only(of_modes, one, shifts) for one in starts]
        costs = [
            (gear.problem.update_weighting(gear.point).cost(gear.point), gear.point)
            for gear in fits
            if gear is not None
        ]
        if costs:
            cost, point = min(costs, key=lambda one: one[0])
            found.append((cost, of_modes, point))
    return [(modes, point) for _, modes, point in sorted(found, key=lambda one: one[0])]


def _compare(found: LikelihoodFit, priors: Sequence[PriorValue]) -> PlantEvidence:
    """Compare a fit with the dual clutch, sought from the same unknowns with the same weighting.

    Where that cannot be simulated it counts as far as a search may be from the measurement.
    """
    plain = found.problem.drop_plant_effect()
    count = plain.lower.size
    start = ParameterVector(found.point.names[:count], found.point.values[:count])
    other = minimise(plain, start)
    if other is None:
        nats = 0.5 * (MULTI_START.far_chi2 * found.problem.size - found.normal.cost)
        return PlantEvidence(EffectId.BACKLASH, nats, np.zeros_like(found.point.values), count)
    return compare_plants(other, found, EffectId.BACKLASH, found.chi2, priors)
