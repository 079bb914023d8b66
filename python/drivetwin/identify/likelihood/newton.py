# SPDX-License-Identifier: MIT
"""Damped Gauss-Newton (Levenberg 1944, Marquardt 1963) on the information matrix.

The unknowns differ by ten orders of magnitude in size; every matrix is scaled to a unit diagonal
before it is solved. The search ends where a full step would lower Q by less than a small part of
one, which is the same part of a standard deviation squared for every unknown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin.identify.likelihood.problem import Normal, Problem
from drivetwin.identify.likelihood.unknowns import Point
from drivetwin.identify.signals import FloatArray

ENOUGH = 1e-3
"""Expected fall of Q at which the search ends: 0.03 standard deviations."""
DAMPING = 1e-3
"""First damping relative to the diagonal of the information."""
LARGEST = 1e8
"""Damping at which no step is left to try."""


@dataclass(frozen=True)
class Found:
    """Where a search ended: the point, its expansion, and whether it is a minimum."""

    point: Point
    normal: Normal
    converged: bool
    iterations: int


def step_of(matrix: FloatArray, gradient: FloatArray, damping: float = 0.0) -> FloatArray:
    """-(matrix + damping·diag)⁻¹·gradient (p,), scaled; directions without information stay."""
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    unit = matrix / np.outer(scale, scale)
    unit[np.diag_indices_from(unit)] += damping
    return np.asarray(
        -np.linalg.lstsq(unit, gradient / scale, rcond=1e-13)[0] / scale, dtype=float
    )


def minimise(problem: Problem, start: Point, limit: int = 30) -> Found | None:
    """Search from `start`; None where the simulation fails there.

    Not converged after `limit` expansions of Q says so; the values are then no estimate.
    """
    point = start.moved(np.clip(start.values, problem.lower, problem.upper))
    normal = problem.normal(point)
    if normal is None:
        return None
    damping = DAMPING
    for iteration in range(limit):
        if _expected(problem, point, normal) < ENOUGH:
            return Found(point, normal, True, iteration)
        accepted = None
        while accepted is None and damping < LARGEST:
            step = step_of(normal.information, normal.gradient, damping)
            trial = point.moved(np.clip(point.values + step, problem.lower, problem.upper))
            cost = problem.cost(trial)
            if cost < normal.cost:
                accepted = problem.normal(trial)
            damping = damping / 10.0 if accepted else damping * 10.0
        if accepted is None:
            return Found(point, normal, False, iteration)
        point, normal = trial, accepted
    return Found(point, normal, False, limit)


def _expected(problem: Problem, point: Point, normal: Normal) -> float:
    """Fall of Q that a full step within the bounds promises."""
    step = step_of(normal.information, normal.gradient)
    step = np.clip(point.values + step, problem.lower, problem.upper) - point.values
    return -float(2.0 * step @ normal.gradient + step @ normal.information @ step)
