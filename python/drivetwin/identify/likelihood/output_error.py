# SPDX-License-Identifier: MIT
"""Staged output error: what to do where the start values are far off.

The simulation of a whole shift with wrong parameters locks at the wrong time, and Q has local
minima. Fitted piece by piece it has none in practice: first the lower gear alone, which fixes
inertia, load and shaft; then up to lock-up, which fixes the friction; then all. Of friction the
lower gear shows nothing, so it is held there; and since Q has minima over its level too, that is
looked for by simulation alone before the search goes on from the best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drivetwin.identify.likelihood.newton import Found, minimise
from drivetwin.identify.likelihood.problem import Part, Problem
from drivetwin.identify.likelihood.unknowns import Point
from drivetwin.shifts.shift import Shift

CLEAR = 0.02
"""Distance kept from the phase boundary at which a stage ends [s]."""
SOUGHT = ("J_e", "J_out", "J_vehicle", "k_o", "c_o")
"""Unknowns that a stage seeks about its start only: a short span hardly tells some of them, and
far off the driveline is so stiff that one run takes as long as a whole fit."""
ABOUT = 10.0
"""Factor on either side of the start within which they are sought."""
HOPELESS = 20.0
"""Q per sample with input noise after a stage above which no other follows."""
LEVEL = "mu_c"
LEVELS = np.geomspace(0.5, 2.0, 13)
"""Factors on the level of an element's friction that are looked at."""
LOOKS = 2
"""How often each element is looked at: the instant at which one lets go hangs on the other."""


def staged(problem: Problem, start: Point, shifts: Sequence[Shift]) -> Found | None:
    """Output error over growing spans, weighted by sensor noise.

    None where a run fails, and where a stage ends far from the measurement.
    """
    problem = _about(problem, start)
    found = in_lower_gear(problem, start, shifts)
    if found is None or _hopeless(found):
        return None
    slipping = problem.until([s.lockup_time - CLEAR for s in shifts])
    found = minimise(slipping, _levelled(slipping, found.point), rough=True)
    if found is None or _hopeless(found):
        return None
    plain = replace(
        problem, parts=tuple(Part.unweighted(p.structure, p.record) for p in problem.parts)
    )
    found = minimise(plain, found.point, rough=True)
    return None if found is None or _hopeless(found) else found


def in_lower_gear(problem: Problem, start: Point, shifts: Sequence[Shift]) -> Found | None:
    """Output error over the gear before each shift alone; None where a run fails."""
    gear = _without_friction(_about(problem, start), start)
    return minimise(gear.until([s.before[1] - CLEAR for s in shifts]), start, rough=True)


def _hopeless(found: Found) -> bool:
    """Whether input noise, which the stages leave out, cannot be what is left by one."""
    problem = found.problem.weighted_by(found.point)
    return problem.cost(found.point) > HOPELESS * problem.size


def _without_friction(problem: Problem, start: Point) -> Problem:
    """The problem with all that belongs to the elements held at the start."""
    prior = problem.prior
    elements = {one.name for part in problem.parts for one in part.structure.elements}
    for k, name in enumerate(start.names):
        if name.rpartition(".")[0] in elements:
            prior = prior.held(k, start[name])
    return replace(problem, prior=prior)


def _levelled(problem: Problem, point: Point) -> Point:
    """The point with the friction levels, of those looked at, that leave least."""
    levels = [k for k, name in enumerate(point.names) if name.endswith(f".{LEVEL}")]
    for k in levels * LOOKS:
        trials = []
        for factor in LEVELS:
            values = point.values.copy()
            values[k] = np.clip(factor * values[k], problem.lower[k], problem.upper[k])
            trials.append(point.moved(values))
        point = min(trials, key=problem.cost)
    return point


def _about(problem: Problem, start: Point) -> Problem:
    """The problem with bounds about the start, of what starts above zero."""
    sought = np.array([name in SOUGHT for name in start.names]) & (start.values > 0.0)
    lower = np.where(sought, np.maximum(problem.lower, start.values / ABOUT), problem.lower)
    upper = np.where(sought, np.minimum(problem.upper, start.values * ABOUT), problem.upper)
    return replace(problem, lower=lower, upper=upper)
