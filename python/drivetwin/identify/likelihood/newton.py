# SPDX-License-Identifier: MIT
"""Damped Gauss-Newton (Levenberg 1944, Marquardt 1963) on the information matrix.

The unknowns differ by ten orders of magnitude in size; every matrix is scaled to a unit diagonal
before it is solved. The search ends where a full step would lower Q by less than a small part of
one, which is the same part of a standard deviation squared for every unknown.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from drivetwin.identify.likelihood.problem import Normal, Problem
from drivetwin.identify.likelihood.retraction import ahead
from drivetwin.identify.likelihood.unknowns import Point
from drivetwin.identify.signals import FloatArray
from drivetwin.progress import tell

ENOUGH = 1e-2
"""Expected fall of Q at which the search ends: 0.1 standard deviations."""
STALLED = 0.3
"""Expected fall of Q below which a point that no step improves is a minimum all the same.

Pressure noise about P0 fills and vents an element many times, and each such instant is a small
kink of Q, where the expansion promises what no step keeps."""
DAMPING = 1e-3
"""First damping relative to the diagonal of the information."""
LARGEST = 1e8
"""Damping at which no step is left to try."""
MAX_STEPS = 40
ROUGH_STEPS = 20
"""Steps after which a rough search ends: one that crawls prepares nothing."""
REFRESHES = 3
"""Least number of points at which Q is formed anew: near the minimum it settles in two."""
CLOSE = 10.0
"""Expected fall of Q from which on it is no longer formed anew: it may alternate about a kink."""

ROUGH = 1e-3
"""Fall of Q relative to Q at which a search ends that only prepares the next one."""

Refresh = Callable[[Problem, Point], Problem]


@dataclass(frozen=True)
class Found:
    """Where a search ended: the point, Q and its expansion there, and whether it is a minimum."""

    problem: Problem
    point: Point
    normal: Normal
    converged: bool
    iterations: int


def step_of(matrix: FloatArray, gradient: FloatArray, damping: float = 0.0) -> FloatArray:
    """-(matrix + damping·diag)⁻¹·gradient (p,), scaled; directions without information stay."""
    scale = _scale(matrix)
    unit = matrix / np.outer(scale, scale)
    unit[np.diag_indices_from(unit)] += damping
    return np.asarray(-np.linalg.lstsq(unit, gradient / scale, rcond=1e-13)[0] / scale, dtype=float)


def _scale(matrix: FloatArray) -> FloatArray:
    """Root of the diagonal (p,); 1 where there is no information."""
    diagonal = np.diag(matrix)
    return np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))


def unchanged(problem: Problem, _: Point) -> Problem:
    """A Q that stays the same during the search."""
    return problem


def minimise(
    problem: Problem, start: Point, refresh: Refresh = unchanged, rough: bool = False
) -> Found | None:
    """Search from `start`; None where the simulation fails there.

    `refresh` gives Q anew at every point until the minimum is close, for a weighting that follows.
    A `rough` search ends where Q hardly falls any more. Not converged after `MAX_STEPS` says so;
    the values are then no estimate.
    """
    point = start.moved(np.clip(start.values, problem.lower, problem.upper))
    damping, first, settled = DAMPING, None, refresh is unchanged
    most = ROUGH_STEPS if rough else MAX_STEPS
    for iteration in range(most):
        if not settled:
            problem = refresh(problem, point)
        normal = problem.normal(point)
        if normal is None:
            return None
        expected = _expected(problem, point, normal)
        first = first or expected
        tell(_done(first, expected))
        settled = settled or (iteration + 1 >= REFRESHES and expected < CLOSE)
        if expected < ENOUGH and settled:
            return Found(problem, point, normal, True, iteration)
        trial, fall, damping = _better(problem, point, normal, damping)
        if rough and trial is not None and fall < ROUGH * normal.cost:
            return Found(problem, trial, normal, True, iteration)
        if trial is None or (fall < ENOUGH and expected < STALLED and settled):
            return Found(problem, point, normal, expected < STALLED, iteration)
        point = trial
    last = problem.normal(point)
    return None if last is None else Found(problem, point, last, False, most)


def _done(first: float, expected: float) -> float:
    """Share of the way, in powers of ten, from the first expected fall of Q to `ENOUGH`."""
    if min(first, expected) <= ENOUGH:
        return 1.0
    return float(np.log(first / expected) / np.log(first / ENOUGH))


def _better(
    problem: Problem, point: Point, normal: Normal, damping: float
) -> tuple[Point | None, float, float]:
    """A point with less Q, by how much less, and the next damping, raised until there is one."""
    while damping < LARGEST:
        values = ahead(point, _step(problem, point, normal, damping))
        trial = point.moved(np.clip(values, problem.lower, problem.upper))
        fall = normal.cost - problem.cost(trial)
        if fall > 0.0:
            return trial, fall, damping / 10.0
        damping *= 10.0
    return None, 0.0, damping


def _step(problem: Problem, point: Point, normal: Normal, damping: float) -> FloatArray:
    """Step (p,) to the least expanded Q within the bounds.

    Cut at a bound one unknown would undo what those that nearly compensate it gain, so the bounds
    are part of the least-squares problem (Stark and Parker 1995).
    """
    room = np.array([problem.lower, problem.upper]) - point.values
    step = step_of(normal.information, normal.gradient, damping)
    if np.all((step >= room[0]) & (step <= room[1])):
        return step
    scale = _scale(normal.information)
    unit = normal.information / np.outer(scale, scale)
    power, directions = np.linalg.eigh(unit + damping * np.eye(scale.size))
    root = np.sqrt(np.maximum(power, 1e-13 * power[-1]))
    target = -(directions.T @ (normal.gradient / scale)) / root
    bounds = (room[0] * scale, room[1] * scale)
    found = lsq_linear(root[:, None] * directions.T, target, bounds, method="bvls")
    return np.asarray(np.clip(found.x / scale, *room))


def _expected(problem: Problem, point: Point, normal: Normal) -> float:
    """Fall of Q that a full step within the bounds promises."""
    step = _step(problem, point, normal, 0.0)
    return -float(2.0 * step @ normal.gradient + step @ normal.information @ step)
