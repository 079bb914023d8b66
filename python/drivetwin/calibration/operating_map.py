# SPDX-License-Identifier: MIT
"""Calibrations polished from a neighbour: a grid of operating points, and a Pareto front.

Map: the grid point in the middle is searched; all others are polished from the nearest one that is
finished. Policies have bounds in proportion to what the shift needs, so that equal coordinates
between the bounds are a scaled calibration. Neighbours descend from one solution; between grid
points values are linear in torque, speed and oil temperature, as a controller interpolates them.

Front of comfort, friction energy and shift time around a calibration: two arms start at the
calibration; one moves the limit of the shift time, the other that of the friction energy. Each
point starts from the one before it and is polished, not searched: the front is local. Its figures
are those of fresh draws; dominated points are left out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise, product
from operator import getitem

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import TimedStages, scale_progress
from drivetwin.calibration.calibrate import (
    Assessment,
    Calibration,
    Task,
    assess,
    calibrate,
    draw_for,
    make_quick_plant,
    polish_from,
    set_coarse_step,
)
from drivetwin.calibration.evaluate import Plant
from drivetwin.calibration.maneuver import OperatingPoint
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.objective import Limit, Statistic
from drivetwin.calibration.policy import Space
from drivetwin.calibration.scenarios import Purpose, Scenarios
from drivetwin.errors import InputError

MakeTask = Callable[[OperatingPoint], Task]
"""Problem at an operating point."""
Place = tuple[int, ...]
"""Indices of torque and speed in a grid, and of the oil temperature if it has an axis of it."""


@dataclass(frozen=True)
class Grid:
    """Engine torques [N m], engine speeds [rad/s] and oil temperatures [K], each increasing.

    Each axis has at least two; without oil temperatures all points are at that of the twin's log.
    Raises InputError for others.
    """

    torques: tuple[float, ...]
    speeds: tuple[float, ...]
    oil_temperatures: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for name, values in zip(("torques", "speeds", "oil temperatures"), self.axes, strict=False):
            if len(values) < 2 or any(b <= a for a, b in pairwise(values)):
                raise InputError(
                    f"the {name} of the map are {values}", "give at least two that increase"
                )

    @property
    def axes(self) -> list[tuple[float, ...]]:
        """Axes in the order of a place."""
        oil = [self.oil_temperatures] if self.oil_temperatures else []
        return [self.torques, self.speeds, *oil]

    @property
    def start(self) -> Place:
        """Point that is searched first, in the middle."""
        return tuple(len(axis) // 2 for axis in self.axes)

    @property
    def places(self) -> list[Place]:
        """All points, those near the start first."""
        places = product(*(range(len(axis)) for axis in self.axes))
        return sorted(places, key=lambda one: _measure_distance(one, self.start))

    @property
    def centres(self) -> list[OperatingPoint]:
        """Operating points in the middle of the cells."""
        cells = product(*(pairwise(axis) for axis in self.axes))
        return [OperatingPoint(*(0.5 * sum(ends) for ends in cell)) for cell in cells]


@dataclass(frozen=True, eq=False)
class MapPoint:
    """Calibration of an operating point and its certificate on fresh draws."""

    task: Task
    found: Assessment

    @property
    def jerk(self) -> float:
        """Peak jerk [m/s^3] for 95 % of the units."""
        return self.found.certificate.quantiles[Metric.PEAK_JERK].share_95


_STAGES = TimedStages("map", ("main", "point", "between"))


@dataclass(frozen=True, eq=False)
class OperatingMap:
    """Calibrations by place in a grid; `main` is the whole one of the start.

    `between` are the interpolated values at the centres of the cells, assessed on fresh draws.
    """

    grid: Grid
    main: Calibration
    points: Mapping[Place, MapPoint]
    between: tuple[MapPoint, ...]
    runs: int

    def interpolate(self, point: OperatingPoint) -> FloatArray:
        """Values (p,) at an operating point, linear along each axis, within the grid.

        Raises InputError outside it.
        """
        return _interpolate(self.grid, self.points, point)


def calibrate_map(make_task: MakeTask, grid: Grid) -> OperatingMap:
    """Calibrate all points of a grid.

    A point may exceed a limit; its certificate says so. Raises InputError for an operating point
    that has no such policy.
    """
    tasks = {
        place: make_task(OperatingPoint(*map(getitem, grid.axes, place))) for place in grid.places
    }
    rest = grid.places[1:]
    timed = _STAGES.repeat("point", len(rest)).repeat("between", len(grid.centres))
    with timed.enter("main"):
        main = calibrate(tasks[grid.start])
    space = Space(main.task.policy)
    coordinates = {grid.start: space.to_coordinates(main.after.values)}
    points, runs = {grid.start: MapPoint(main.task, main.after)}, main.runs
    for number, place in enumerate(rest):
        task, plant = tasks[place], make_quick_plant(tasks[place])
        near = min(coordinates, key=lambda one: _measure_distance(one, place))
        with timed.enter("point", "calibrating the map", number):
            found = polish_from(task, set_coarse_step(plant), coordinates[near])
            coordinates[place] = found.coordinates
            points[place] = _assess(task, Space(task.policy).to_values(coordinates[place]))
        runs += plant.count.runs
    between = []
    for number, one in enumerate(grid.centres):
        with timed.enter("between", "certifying between the points", number):
            between.append(_assess(make_task(one), _interpolate(grid, points, one)))
    return OperatingMap(grid, main, points, tuple(between), runs)


def _measure_distance(one: Place, other: Place) -> int:
    return sum(abs(first - second) for first, second in zip(one, other, strict=True))


def _assess(task: Task, values: FloatArray) -> MapPoint:
    plant = replace(make_quick_plant(task), metrics=tuple(Metric))
    fresh = draw_for(task, task.settings.neighbour_fresh_draws, Purpose.CERTIFICATE)
    coordinates = Space(task.policy).to_coordinates(values)
    return MapPoint(task, assess(task, plant, coordinates, fresh))


def _interpolate(grid: Grid, points: Mapping[Place, MapPoint], point: OperatingPoint) -> FloatArray:
    axes = [np.array(axis) for axis in grid.axes]
    values = [points[place].found.values for place in sorted(points)]
    table = np.reshape(values, (*(axis.size for axis in axes), -1))
    oil = point.oil_temperature
    at = [point.engine_torque, point.engine_speed, *([] if oil is None else [oil])]
    if len(at) != len(axes):
        raise InputError(
            "the operating point has an oil temperature and the map has none, or the reverse",
            "state it exactly where the map has an axis of it",
        )
    if not all(axis[0] <= one <= axis[-1] for axis, one in zip(axes, at, strict=True)):
        ends = " and ".join(
            f"{axis[0]:g} to {axis[-1]:g} {unit}"
            for axis, unit in zip(axes, ("N·m", "rad/s", "K"), strict=False)
        )
        raise InputError(
            f"an engine torque of {at[0]:g} N·m at {at[1]:g} rad/s"
            + (f" and {oil:g} K" if oil is not None else "")
            + " is outside the map",
            f"take {ends}",
        )
    return np.asarray(RegularGridInterpolator(axes, table)(np.array([at]))[0], dtype=np.float64)


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
    first = _assess_on_front(task, plant, fresh, (Arm.CALIBRATION, start))
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
            points.append(_assess_on_front(task, plant, fresh, (arm, at)))
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


def _assess_on_front(
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
