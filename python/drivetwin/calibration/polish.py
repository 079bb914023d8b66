# SPDX-License-Identifier: MIT
"""Local polish by sequential linear programming with a trust region.

In each step peak jerk and limits are linear in the coordinates, by forward differences over common
scenarios. The linear program minimises the tail mean of peak jerk in its epigraph form and the
excess over limits. Source: J. Nocedal and S. J. Wright, Numerical Optimization, section 18.5
(Sℓ1LP); R. T. Rockafellar and S. Uryasev, Journal of Risk 2 (2000), for the tail mean.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import notify_progress
from drivetwin.calibration.metrics import Outcome
from drivetwin.calibration.objective import Limit, Objective, Statistic
from drivetwin.calibration.search import Candidate

Run = Callable[[Sequence[FloatArray]], list[Outcome]]
"""Outcomes of candidates, coordinates (q,), over the scenarios."""

_DIFFERENCE = 2e-5
"""Step of the differences, in shares of the ranges.

The simulation is exact and piecewise smooth. A longer step passes changes in the order of events,
where the slope has no meaning; a shorter one comes near the tolerance of the solver.
"""
_PEAKS = 8
"""Local maxima of |jerk| per scenario that enter a linear program."""
_BESIDE = 3
"""Samples beside a maximum that enter too, since it moves."""
_STEEPEST = 5e4
"""Slope of jerk [m/s^3 per range] beyond which a difference straddles an event."""
_FIRST_RADIUS, _LEAST_RADIUS, _LARGEST_RADIUS = 0.03, 2e-4, 0.25
"""Trust region in shares of the ranges."""
_RADII = (1.0, 0.3, 0.1)
"""Shares of the trust region in which the linear program is solved and its step tried."""
_GROWTH, _KEPT, _SHRINK = 2.0, 1.5, 0.05
"""Factors on the radius: after the largest step, on the radius of a smaller one, after none."""
_STALL = 2e-3
"""Relative gain below which an iteration counts as none."""
_STALLS = 4
"""Iterations without gain after which the polish ends."""


@dataclass(frozen=True, eq=False)
class _Linear:
    """Rows of a linear program: `value` (r,) and `slope` (r, q) of what scenario `owner` has."""

    value: FloatArray
    slope: FloatArray
    owner: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class _Program:
    """Linear program at coordinates `at` (q,): cost, matrix and bounds of its rows."""

    at: FloatArray
    cost: FloatArray
    matrix: FloatArray
    bound: FloatArray

    def solve(self, radius: float) -> FloatArray:
        """Return the best coordinates (q,) within a radius; `at` where there is no solution."""
        at = self.at
        box = list(zip(np.maximum(-radius, -at), np.minimum(radius, 1.0 - at), strict=True))
        slack = [(0.0, None)] * (self.cost.size - at.size - 1)
        solved = linprog(
            self.cost,
            A_ub=self.matrix,
            b_ub=self.bound,
            bounds=[*box, (None, None), *slack],
            method="highs",
        )
        step = solved.x[: at.size] if solved.x is not None else np.zeros(at.size)
        return np.asarray(np.clip(at + step, 0.0, 1.0))


def polish(run: Run, start: FloatArray, objective: Objective, iterations: int) -> Candidate:
    """Improve coordinates (q,) from `start` by at most `iterations` linear programs.

    Each is solved in trust regions of several radii, so that one linearisation serves them all.
    """
    at, outcome = start, run([start])[0]
    best, radius, stalls = objective.evaluate(outcome), _FIRST_RADIUS, 0
    program = None
    for iteration in range(iterations):
        notify_progress(iteration / iterations)
        program = program or _build_program(run, at, outcome, objective)
        tried = [program.solve(share * radius) for share in _RADII]
        outcomes = run(tried)
        values = [objective.evaluate(one) for one in outcomes]
        chosen = int(np.argmin(values))
        gain = best - values[chosen]
        if gain > 0.0:
            at, outcome, best, program = tried[chosen], outcomes[chosen], values[chosen], None
        radius = _change_radius(radius, chosen if gain > 0.0 else None)
        stalls = stalls + 1 if gain < _STALL * best else 0
        if stalls == _STALLS or radius < _LEAST_RADIUS:
            break
    notify_progress(1.0)
    return Candidate(at, best)


def _change_radius(radius: float, chosen: int | None) -> float:
    """Return the radius after the step of place `chosen` in the radii; None without a gain."""
    if chosen is None:
        return _SHRINK * radius
    return min((_KEPT if chosen else _GROWTH) * _RADII[chosen] * radius, _LARGEST_RADIUS)


def _build_program(run: Run, at: FloatArray, outcome: Outcome, objective: Objective) -> _Program:
    """Linearise jerk and limits at coordinates (q,)."""
    signs = np.where(at < 0.5, 1.0, -1.0)
    moved = run([at + _DIFFERENCE * step for step in np.diag(signs)])
    width = _DIFFERENCE * signs
    jerk = _linearise_jerk(outcome, moved, width)
    limits = [_linearise_limit(one, outcome, moved, width) for one in objective.limits]
    return _Program(at, *_assemble(objective, jerk, limits, outcome.jerk.shape[0]))


def _linearise_jerk(outcome: Outcome, moved: list[Outcome], width: FloatArray) -> _Linear:
    size = np.abs(outcome.jerk)
    rows, columns = [], []
    for owner, values in enumerate(size):
        inner = values[1:-1]
        peaks = 1 + np.flatnonzero((inner >= values[:-2]) & (inner >= values[2:]))
        peaks = peaks[np.argsort(-values[peaks])[:_PEAKS]]
        near = np.concatenate([peaks, peaks - _BESIDE, peaks + _BESIDE])
        near = np.unique(np.clip(near, 0, values.size - 1))
        rows.append(np.full(near.size, owner))
        columns.append(near)
    r, c = np.concatenate(rows), np.concatenate(columns)
    base = outcome.jerk[r, c]
    sign = np.sign(base)
    slope = np.stack([sign * (one.jerk[r, c] - base) / h
                      for one, h in zip(moved, width, strict=True)], axis=1)  # fmt: skip
    kept = np.abs(slope).max(axis=1) < _STEEPEST
    return _Linear(np.abs(base)[kept], slope[kept], r[kept])


def _linearise_limit(
    limit: Limit, outcome: Outcome, moved: list[Outcome], width: FloatArray
) -> _Linear:
    """Relative distance from a limit, of each scenario or of their mean."""

    def measure(one: Outcome) -> FloatArray:
        values = one.values[limit.metric] / limit.bound - 1.0
        mean = limit.statistic is Statistic.MEAN
        return np.asarray(values.mean(keepdims=True) if mean else values)

    base = measure(outcome)
    slope = np.stack([(measure(one) - base) / h for one, h in zip(moved, width, strict=True)],
                     axis=1)  # fmt: skip
    return _Linear(base, slope, np.arange(base.size))


def _assemble(
    objective: Objective, jerk: _Linear, limits: list[_Linear], scenarios: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cost, matrix and bounds over step (q,), threshold, excess over it (runs,), and the limits'.

    The tail mean is the threshold plus the mean excess over it divided by 1 - share.
    """
    q, rows = jerk.slope.shape[1], jerk.value.size
    counts = [one.value.size for one in limits]
    tail = 1.0 / ((1.0 - objective.share) * scenarios)
    excess = [np.full(count, objective.weight / count) for count in counts]
    cost = np.concatenate([np.zeros(q), [1.0], np.full(scenarios, tail), *excess])
    matrix = np.zeros((rows + sum(counts), cost.size))
    matrix[:rows, :q] = jerk.slope
    matrix[:rows, q] = -1.0
    matrix[np.arange(rows), q + 1 + jerk.owner] = -1.0
    row, column = rows, q + 1 + scenarios
    for one, count in zip(limits, counts, strict=True):
        matrix[row : row + count, :q] = one.slope
        matrix[row + np.arange(count), column + np.arange(count)] = -1.0
        row, column = row + count, column + count
    return cost, matrix, np.concatenate([-jerk.value, *(-one.value for one in limits)])
