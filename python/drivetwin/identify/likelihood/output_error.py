# SPDX-License-Identifier: MIT
"""Staged output-error start for initial values that are far off.

The simulation of a whole shift with wrong parameters locks at the wrong time, and Q has local
minima. Fitted piece by piece it has none in practice: first the lower gear alone, which fixes
inertia, load and shaft; then up to lock-up, which fixes the friction; then all. Of friction the
lower gear shows nothing, so it is held there; and since Q has minima over its level too, that is
looked for by simulation alone before the search goes on from the best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.identify.likelihood.problem import Part, Problem
from drivetwin.identify.optimize.gauss_newton import Found, minimise
from drivetwin.identify.optimize.objective import Point
from drivetwin.shifts.shift import Shift

SOUGHT = ("J_e", "J_out", "J_vehicle", "k_o", "c_o")
"""Unknowns that a stage seeks about its start only: a short span hardly shows some of them, and
far off the driveline is so stiff that one run takes as long as a whole fit."""
LEVEL = "mu_c"


@dataclass(frozen=True)
class StagedStartSettings:
    """Settings of the staged output-error start."""

    clearance: float = 0.02
    """Distance kept from the phase boundary at which a stage ends [s]."""
    search_factor: float = 10.0
    """Factor to either side of the start within which the unknowns `SOUGHT` are sought [-]."""
    max_chi2: float = 20.0
    """Q per sample with input noise after a stage above which no other follows [-]."""
    min_friction_factor: float = 0.5
    """Smallest factor on the friction level that is tried [-]."""
    max_friction_factor: float = 2.0
    """Largest factor on the friction level that is tried [-]."""
    friction_factors: int = 13
    """Number of factors on the friction level, evenly spaced in the logarithm [-]."""
    friction_passes: int = 2
    """Number of passes over the elements: the instant at which one breaks away depends on the
    other [-]."""


STAGED_START = StagedStartSettings()


def staged(problem: Problem, start: Point, shifts: Sequence[Shift]) -> Found[Problem] | None:
    """Fit the output error over growing spans, weighted by sensor noise.

    Returns None if a run fails, or if a stage ends far from the measurement.
    """
    problem = _about(problem, start)
    found = in_lower_gear(problem, start, shifts)
    if found is None or _hopeless(found):
        return None
    slipping = problem.until([s.lockup_time - STAGED_START.clearance for s in shifts])
    found = minimise(slipping, _levelled(slipping, found.point), rough=True)
    if found is None or _hopeless(found):
        return None
    plain = replace(
        problem, parts=tuple(Part.unweighted(p.structure, p.record) for p in problem.parts)
    )
    found = minimise(plain, found.point, rough=True)
    return None if found is None or _hopeless(found) else found


def in_lower_gear(problem: Problem, start: Point, shifts: Sequence[Shift]) -> Found[Problem] | None:
    """Fit the output error over the gear before each shift alone; None if a run fails."""
    gear = _without_friction(_about(problem, start), start)
    return minimise(
        gear.until([s.before[1] - STAGED_START.clearance for s in shifts]), start, rough=True
    )


def _hopeless(found: Found[Problem]) -> bool:
    """Return whether a stage ended too far from the measurement for input noise to explain it."""
    problem = found.problem.weighted_by(found.point)
    return problem.cost(found.point) > STAGED_START.max_chi2 * problem.size


def _without_friction(problem: Problem, start: Point) -> Problem:
    """Fix all parameters of the elements at the start."""
    prior = problem.prior
    elements = {one.name for part in problem.parts for one in part.structure.elements}
    for k, name in enumerate(start.names):
        if name.rpartition(".")[0] in elements:
            prior = prior.held(k, start[name])
    return replace(problem, prior=prior)


def _levelled(problem: Problem, point: Point) -> Point:
    """Scale the friction levels to the tried factors with the smallest Q."""
    factors = np.geomspace(
        STAGED_START.min_friction_factor,
        STAGED_START.max_friction_factor,
        STAGED_START.friction_factors,
    )
    levels = [k for k, name in enumerate(point.names) if name.endswith(f".{LEVEL}")]
    for k in levels * STAGED_START.friction_passes:
        trials = []
        for factor in factors:
            values = point.values.copy()
            values[k] = np.clip(factor * values[k], problem.lower[k], problem.upper[k])
            trials.append(point.moved(values))
        point = min(trials, key=problem.cost)
    return point


def _about(problem: Problem, start: Point) -> Problem:
    """Restrict positive unknowns of `SOUGHT` to bounds about the start."""
    sought = np.array([name in SOUGHT for name in start.names]) & (start.values > 0.0)
    lower = np.where(
        sought, np.maximum(problem.lower, start.values / STAGED_START.search_factor), problem.lower
    )
    upper = np.where(
        sought, np.minimum(problem.upper, start.values * STAGED_START.search_factor), problem.upper
    )
    return replace(problem, lower=lower, upper=upper)
