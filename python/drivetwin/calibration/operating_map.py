# SPDX-License-Identifier: MIT
"""Calibrations over a grid of operating points, each started from a neighbour.

The grid point in the middle is searched; all others are polished from the nearest one that is
finished. Policies have bounds in proportion to what the shift needs, so that equal coordinates
between the bounds are a scaled calibration. Neighbours descend from one solution; between grid
points values are linear in torque, speed and oil temperature, as a controller interpolates them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import TimedStages
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
from drivetwin.calibration.maneuver import OperatingPoint
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.policy import Space
from drivetwin.calibration.scenarios import Purpose
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

    def get_point(self, place: Place) -> OperatingPoint:
        """Return the operating point of a place."""
        return OperatingPoint(*(axis[k] for axis, k in zip(self.axes, place, strict=True)))

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
    tasks = {place: make_task(grid.get_point(place)) for place in grid.places}
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
