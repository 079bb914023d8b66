# SPDX-License-Identifier: MIT
"""Staged output error: what to do where the start values are far off.

The simulation of a whole shift with wrong parameters locks at the wrong time, and Q has local
minima. Fitted piece by piece it has none in practice: first the lower gear alone, which fixes
inertia, load and shaft; then up to lock-up, which fixes the friction; then all.
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


def staged(problem: Problem, start: Point, shifts: Sequence[Shift]) -> Found | None:
    """Output error over growing spans, weighted by sensor noise; None where a run fails."""
    stages = (
        [shift.before[1] - CLEAR for shift in shifts],
        [shift.lockup_time - CLEAR for shift in shifts],
    )
    point, problem = start, _about(problem, start)
    for ends in stages:
        found = minimise(problem.until(ends), point, rough=True)
        if found is None:
            return None
        point = found.point
    plain = replace(
        problem, parts=tuple(Part.unweighted(p.structure, p.record) for p in problem.parts)
    )
    return minimise(plain, point, rough=True)


def _about(problem: Problem, start: Point) -> Problem:
    """The problem with bounds about the start."""
    sought = np.array([name in SOUGHT for name in start.names])
    lower = np.where(sought, np.maximum(problem.lower, start.values / ABOUT), problem.lower)
    upper = np.where(sought, np.minimum(problem.upper, start.values * ABOUT), problem.upper)
    return replace(problem, lower=lower, upper=upper)
