# SPDX-License-Identifier: MIT
"""Map over operating points: its grid, and values between the points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.calibration.calibrate import Task
from drivetwin.calibration.maneuver import OperatingPoint
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.objective import Limit
from drivetwin.calibration.operating_map import Grid, OperatingMap, calibrate_map
from drivetwin.calibration.policies.controller import build_controller_policy
from drivetwin.errors import InputError
from tests.calibration.cases import SYSTEM, make_task

GRID = Grid((1000.0, 1400.0), (165.0, 185.0))


def make_at(point: OperatingPoint) -> Task:
    task = make_task((Limit(Metric.SHIFT_TIME, 1.2),))
    maneuver = replace(task.maneuver, point=point)
    return replace(task, maneuver=maneuver, policy=build_controller_policy(maneuver, SYSTEM))


@pytest.fixture(scope="module")
def mapped() -> OperatingMap:
    return calibrate_map(make_at, GRID)


def test_all_points_are_calibrated_from_the_start_on(mapped: OperatingMap) -> None:
    assert set(mapped.points) == {(0, 0), (0, 1), (1, 0), (1, 1)}
    start = mapped.points[GRID.start]
    assert start.found is mapped.main.after
    assert start.task.maneuver.point == OperatingPoint(1400.0, 185.0)
    assert mapped.runs > mapped.main.runs
    for place, one in mapped.points.items():
        assert one.task.maneuver.point == GRID.get_point(place)
        assert one.jerk > 0.0


def test_values_between_the_points_are_linear(mapped: OperatingMap) -> None:
    corners = [mapped.points[place].found.values for place in mapped.points]
    middle = mapped.interpolate(OperatingPoint(1200.0, 175.0))
    assert middle == pytest.approx(np.mean(corners, axis=0))
    corner = mapped.interpolate(OperatingPoint(1000.0, 185.0))
    assert corner == pytest.approx(mapped.points[0, 1].found.values)
    (centre,) = mapped.between
    assert centre.task.maneuver.point == OperatingPoint(1200.0, 175.0)
    free = [k for k, one in enumerate(centre.task.policy.parameters) if one.free]
    assert centre.found.values[free] == pytest.approx(middle[free])


def test_outside_the_map_there_is_no_value(mapped: OperatingMap) -> None:
    with pytest.raises(InputError, match="outside the map"):
        mapped.interpolate(OperatingPoint(999.0, 175.0))


@pytest.mark.parametrize("values", [(), (1.0,), (1.0, 1.0), (2.0, 1.0)])
def test_a_grid_increases(values: tuple[float, ...]) -> None:
    with pytest.raises(InputError, match="at least two that increase"):
        Grid(values, (1.0, 2.0))


def test_points_near_the_middle_come_first() -> None:
    grid = Grid((1.0, 2.0, 3.0), (1.0, 2.0, 3.0))
    assert grid.places[0] == grid.start == (1, 1)
    assert grid.places[-1] in ((0, 0), (0, 2), (2, 0), (2, 2))
    assert len(grid.centres) == 4
