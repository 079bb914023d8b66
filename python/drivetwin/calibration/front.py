# SPDX-License-Identifier: MIT
"""Pareto front of comfort, friction energy and shift time around a calibration.

Two arms start at the calibration: one moves the limit of the shift time, the other that of the
friction energy. Each point starts from the one before it and is polished, not searched: the front
is local. Its figures are those of fresh draws; dominated points are left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import scale_progress
from drivetwin.calibration.calibrate import (
    Calibration,
    Task,
    draw_for,
    make_quick_plant,
    polish_from,
    set_coarse_step,
)
from drivetwin.calibration.evaluate import Plant
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.objective import Limit, Statistic
from drivetwin.calibration.policy import Space
from drivetwin.calibration.scenarios import Purpose, Scenarios

_LIMITS = (0.96, 0.92, 0.88, 0.84, 0.80, 0.76)
"""Limits of what an arm moves, over that of the calibration."""
_LONGER = 1.08
"""Limit of the shift time of the first point, over that of the calibration."""
_RELAXED = 1.25
"""Limit of what an arm does not move, over that of the calibration."""
_TOLERANCE = 1e-3
"""Relative difference from which a point counts as worse than another."""


class Arm(StrEnum):
    """Part of the front: the calibration itself, or the arm whose limit was moved."""

    CALIBRATION = "calibration"
    TIME = "shift time"
    ENERGY = "friction energy"


@dataclass(frozen=True, eq=False)
class FrontPoint:
    """A calibration of the front with policy values (p,) and its figures on fresh draws.

    `jerk` [m/s^3] and `time` [s] are for 95 % of the units, `energy` [J] the mean. `exceeded` are
    the other limits of the task that it does not keep.
    """

    arm: Arm
    values: FloatArray
    jerk: float
    energy: float
    time: float
    exceeded: tuple[Limit, ...]

    @property
    def figures(self) -> FloatArray:
        """Comfort, energy and time (3,); smaller is better."""
        return np.array([self.jerk, self.energy, self.time])


@dataclass(frozen=True, eq=False)
class Front:
    """Points that no other one dominates, by shift time; `tried` counts all of them."""

    points: tuple[FrontPoint, ...]
    tried: int
    runs: int


def trace_front(found: Calibration) -> Front:
    """Trace the front from a calibration along both arms."""
    task, plant = found.task, make_quick_plant(found.task, *_FIGURES)
    coarse = set_coarse_step(plant)
    fresh = draw_for(task, task.settings.neighbour_fresh_draws, Purpose.CERTIFICATE)
    start = Space(task.policy).to_coordinates(found.after.values)
    first = _assess(task, plant, fresh, (Arm.CALIBRATION, start))
    points = [first]
    arms = {
        Arm.TIME: [_make_limits(task, first, time, _RELAXED) for time in (_LONGER, *_LIMITS)],
        Arm.ENERGY: [_make_limits(task, first, _RELAXED, energy) for energy in _LIMITS],
    }
    total = sum(map(len, arms.values()))
    for arm, bounds in arms.items():
        at = start
        for limits in bounds:
            share = (len(points) - 1) / total
            with scale_progress(share, share + 1.0 / total, "tracing the front"):
                at = polish_from(task.set_limits(limits), coarse, at).coordinates
            points.append(_assess(task, plant, fresh, (arm, at)))
    kept = select_nondominated(points)
    return Front(tuple(sorted(kept, key=lambda one: one.time)), len(points), plant.count.runs)


def select_nondominated(points: Sequence[FrontPoint]) -> list[FrontPoint]:
    """Select the points that no other is as good as in all figures and better in one.

    Points that exceed a limit are left out, and of equal points all but the first.
    """
    valid = [one for one in points if not one.exceeded]
    kept: list[FrontPoint] = []
    for one in valid:
        equal = any(np.allclose(one.figures, other.figures, rtol=_TOLERANCE) for other in kept)
        if not equal and not any(_dominates(other, one) for other in valid):
            kept.append(one)
    return kept


_FIGURES = (Metric.PEAK_JERK, Metric.FRICTION_ENERGY, Metric.SHIFT_TIME)
_MOVED = (Metric.SHIFT_TIME, Metric.FRICTION_ENERGY)
"""Metrics whose limits the arms move."""


def _dominates(one: FrontPoint, other: FrontPoint) -> bool:
    ratio = one.figures / other.figures
    return bool((ratio <= 1.0).all() and (ratio < 1.0 - _TOLERANCE).any())


def _make_limits(task: Task, first: FrontPoint, time: float, energy: float) -> tuple[Limit, ...]:
    kept = [one for one in task.limits if one.metric not in _MOVED]
    return (
        *kept,
        Limit(Metric.SHIFT_TIME, time * first.time),
        Limit(Metric.FRICTION_ENERGY, energy * first.energy, Statistic.MEAN),
    )


def _assess(
    task: Task, plant: Plant, fresh: Scenarios, place: tuple[Arm, FloatArray]
) -> FrontPoint:
    space, (arm, at) = Space(task.policy), place
    outcome = plant.evaluate(space.build_control(at), fresh)
    jerk, time = (
        float(np.quantile(outcome.values[one], 0.95))
        for one in (Metric.PEAK_JERK, Metric.SHIFT_TIME)
    )
    energy = float(outcome.values[Metric.FRICTION_ENERGY].mean())
    others = [one for one in task.limits if one.metric not in _MOVED]
    exceeded = tuple(one for one in others if np.quantile(one.measure(outcome), 0.95) > 0.0)
    return FrontPoint(arm, space.to_values(at), jerk, energy, time, exceeded)
