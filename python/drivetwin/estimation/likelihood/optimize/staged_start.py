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

from drivetwin.estimation.likelihood.shift_objective import ShiftObjective, ShiftTerm
from drivetwin.estimation.optimize.gauss_newton import OptimizeResult, minimise
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.shifts.shift import Shift

LOCAL_UNKNOWNS = ("J_e", "J_out", "J_vehicle", "k_o", "c_o")
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


def find_staged_start(
    problem: ShiftObjective, start: ParameterVector, shifts: Sequence[Shift]
) -> OptimizeResult[ShiftObjective] | None:
    """Fit the output error over growing spans, weighted by sensor noise.

    Returns None if a run fails, or if a stage ends far from the measurement.
    """
    problem = _restrict_bounds(problem, start)
    found = fit_lower_gear_only(problem, start, shifts)
    if found is None or _is_too_far(found):
        return None
    slipping = problem.cut([s.lockup_time - STAGED_START.clearance for s in shifts])
    found = minimise(slipping, _scale_friction(slipping, found.point), rough=True)
    if found is None or _is_too_far(found):
        return None
    plain = replace(
        problem,
        parts=tuple(ShiftTerm.from_sensor_noise(p.structure, p.record) for p in problem.parts),
    )
    found = minimise(plain, found.point, rough=True)
    return None if found is None or _is_too_far(found) else found


def fit_lower_gear_only(
    problem: ShiftObjective, start: ParameterVector, shifts: Sequence[Shift]
) -> OptimizeResult[ShiftObjective] | None:
    """Fit the output error over the gear before each shift alone; None if a run fails."""
    gear = _fix_friction(_restrict_bounds(problem, start), start)
    return minimise(
        gear.cut([s.before[1] - STAGED_START.clearance for s in shifts]), start, rough=True
    )


def _is_too_far(found: OptimizeResult[ShiftObjective]) -> bool:
    """Return whether a stage ended too far from the measurement for input noise to explain it."""
    problem = found.problem.update_weighting(found.point)
    return problem.cost(found.point) > STAGED_START.max_chi2 * problem.size


def _fix_friction(problem: ShiftObjective, start: ParameterVector) -> ShiftObjective:
    """Fix all parameters of the elements at the start."""
    prior = problem.prior
    elements = {one.name for part in problem.parts for one in part.structure.elements}
    for k, name in enumerate(start.names):
        if name.rpartition(".")[0] in elements:
            prior = prior.fix_parameter(k, start[name])
    return replace(problem, prior=prior)


def _scale_friction(problem: ShiftObjective, point: ParameterVector) -> ParameterVector:
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
            trials.append(point.replace_values(values))
        point = min(trials, key=problem.cost)
    return point


def _restrict_bounds(problem: ShiftObjective, start: ParameterVector) -> ShiftObjective:
    """Restrict positive unknowns of `SOUGHT` to bounds about the start."""
    sought = np.array([name in LOCAL_UNKNOWNS for name in start.names]) & (start.values > 0.0)
    lower = np.where(
        sought, np.maximum(problem.lower, start.values / STAGED_START.search_factor), problem.lower
    )
    upper = np.where(
        sought, np.minimum(problem.upper, start.values * STAGED_START.search_factor), problem.upper
    )
    return replace(problem, lower=lower, upper=upper)
