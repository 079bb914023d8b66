# SPDX-License-Identifier: MIT
"""Calibrations over a grid of engine torque and engine speed, each started from a neighbour.

The grid point in the middle is searched; all others are polished from the nearest one that is
finished. Policies have bounds in proportion to what the shift needs, so that equal coordinates
between the bounds are a scaled calibration. Neighbours descend from one solution; between grid
points values are linear in torque and speed, as a controller interpolates them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise, product

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from drivetwin._util.arrays import FloatArray
from drivetwin._util.timed_stages import TimedStages
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
from drivetwin.calibration.policy import Space
from drivetwin.calibration.scenarios import Purpose
from drivetwin.calibration.stages import NO_STAGES, Stages, name_stage, run_stage
from drivetwin.errors import InputError

MakeTask = Callable[[OperatingPoint], Task]
"""Problem at an operating point."""
Place = tuple[int, int]
"""Indices of torque and speed in a grid."""


@dataclass(frozen=True)
class Grid:
    """Engine torques [N m] and engine speeds [rad/s], each increasing, at least two.

    Raises InputError for others.
    """

    torques: tuple[float, ...]
    speeds: tuple[float, ...]

    def __post_init__(self) -> None:
        for name, values in (("torques", self.torques), ("speeds", self.speeds)):
            if len(values) < 2 or any(b <= a for a, b in pairwise(values)):
                raise InputError(
                    f"the {name} of the map are {values}", "give at least two that increase"
                )

    @property
    def start(self) -> Place:
        """Point that is searched first, in the middle."""
        return len(self.torques) // 2, len(self.speeds) // 2

    @property
    def places(self) -> list[Place]:
        """All points, those near the start first."""
        places = product(range(len(self.torques)), range(len(self.speeds)))
        return sorted(places, key=lambda one: _measure_distance(one, self.start))

    def get_point(self, place: Place) -> OperatingPoint:
        """Return the operating point of a place."""
        return OperatingPoint(self.torques[place[0]], self.speeds[place[1]])

    @property
    def centres(self) -> list[OperatingPoint]:
        """Operating points in the middle of the cells."""
        return [
            OperatingPoint(0.5 * sum(torque), 0.5 * sum(speed))
            for torque, speed in product(pairwise(self.torques), pairwise(self.speeds))
        ]


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
        """Values (p,) at an operating point, linear in torque and speed, within the grid.

        Raises InputError outside it.
        """
        return _interpolate(self.grid, self.points, point)


def calibrate_map(make_task: MakeTask, grid: Grid, stages: Stages = NO_STAGES) -> OperatingMap:
    """Calibrate all points of a grid; `stages` may have some of them.

    A point may exceed a limit; its certificate says so. Raises InputError for an operating point
    that has no such policy.
    """
    tasks = {place: make_task(grid.get_point(place)) for place in grid.places}
    rest = grid.places[1:]
    timed = _STAGES.repeat("point", len(rest)).repeat("between", len(grid.centres))
    with timed.enter("main"):
        main = calibrate(tasks[grid.start], stages)
    space = Space(main.task.policy)
    coordinates = {grid.start: space.to_coordinates(main.after.values)}
    points, runs = {grid.start: MapPoint(main.task, main.after)}, main.runs
    for number, place in enumerate(rest):
        task, plant = tasks[place], make_quick_plant(tasks[place])
        near = min(coordinates, key=lambda one: _measure_distance(one, place))
        with timed.enter("point", "calibrating the map", number):
            coordinates[place] = run_stage(
                stages,
                name_stage("map", grid.get_point(place)),
                (plant, coordinates[near].size),
                partial(_polish, task, plant, coordinates[near]),
            )
            points[place] = _assess(task, Space(task.policy).to_values(coordinates[place]))
        runs += plant.count.runs
    between = []
    for number, one in enumerate(grid.centres):
        with timed.enter("between", "certifying between the points", number):
            between.append(_assess(make_task(one), _interpolate(grid, points, one)))
    return OperatingMap(grid, main, points, tuple(between), runs)


def _polish(task: Task, plant: Plant, start: FloatArray) -> FloatArray:
    return np.asarray(polish_from(task, set_coarse_step(plant), start).coordinates)


def _measure_distance(one: Place, other: Place) -> int:
    return abs(one[0] - other[0]) + abs(one[1] - other[1])


def _assess(task: Task, values: FloatArray) -> MapPoint:
    plant = replace(make_quick_plant(task), metrics=tuple(Metric))
    fresh = draw_for(task, task.settings.neighbour_fresh_draws, Purpose.CERTIFICATE)
    coordinates = Space(task.policy).to_coordinates(values)
    return MapPoint(task, assess(task, plant, coordinates, fresh))


def _interpolate(grid: Grid, points: Mapping[Place, MapPoint], point: OperatingPoint) -> FloatArray:
    axes = np.array(grid.torques), np.array(grid.speeds)
    table = np.array(
        [
            [points[i, j].found.values for j in range(len(grid.speeds))]
            for i in range(len(grid.torques))
        ]
    )
    at = point.engine_torque, point.engine_speed
    if not all(axis[0] <= one <= axis[-1] for axis, one in zip(axes, at, strict=True)):
        raise InputError(
            f"an engine torque of {at[0]:g} N·m at {at[1]:g} rad/s is outside the map",
            f"take {axes[0][0]:g} to {axes[0][-1]:g} N·m and {axes[1][0]:g} to {axes[1][-1]:g} "
            "rad/s",
        )
    return np.asarray(RegularGridInterpolator(axes, table)(np.array([at]))[0], dtype=np.float64)
