# SPDX-License-Identifier: MIT
"""Whole calibrations, small: better than the start, reproducible, within limits."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin.calibration.calibrate import Calibration, Task, calibrate
from drivetwin.calibration.front import trace_front
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.objective import Limit
from drivetwin.calibration.operating_map import Grid, calibrate_map
from drivetwin.calibration.policies.kind import PolicyKind
from drivetwin.errors import InputError
from tests.calibration.cases import SHIFTS, draw, make_plant, make_task

TIME = (Limit(Metric.SHIFT_TIME, 0.95),)


def make_coarse(
    limits: tuple[Limit, ...] = (), shift: str = "power-on upshift", **given: Any
) -> Task:
    """Task with steps of 2 ms."""
    task = make_task(**SHIFTS[shift], limits=limits, **given)
    return replace(task, maneuver=replace(task.maneuver, step=2e-3))


def compare_jerk(found: Calibration) -> float:
    """Peak jerk of 95 % of the units, over that of the start."""
    old, new = (
        one.certificate.quantiles[Metric.PEAK_JERK].share_95 for one in (found.before, found.after)
    )
    return new / old


@pytest.fixture(scope="module")
def found() -> Calibration:
    return calibrate(make_coarse(TIME))


def test_improves_on_fresh_draws_and_repeats_itself(found: Calibration) -> None:
    again = calibrate(make_coarse(TIME))
    assert compare_jerk(found) < 0.9
    assert np.array_equal(found.after.values, again.after.values)
    assert found.after.certificate.limits[0].value <= 0.95
    assert found.runs == again.runs > 0


@pytest.mark.parametrize("kind", [PolicyKind.CONTROLLER, PolicyKind.KNOTS])
def test_an_inertia_phase_that_comes_first_is_calibrated(kind: PolicyKind) -> None:
    found = calibrate(make_coarse(shift="power-on downshift", policy=kind))
    assert compare_jerk(found) < 0.9
    assert found.after.certificate.unlocked == 0


def test_a_slip_loop_is_calibrated_behind_the_actuators() -> None:
    found = calibrate(make_coarse(TIME, policy=PolicyKind.SLIP))
    assert compare_jerk(found) < 0.9
    assert found.after.certificate.draws == len(found.fresh.units)
    assert found.after.profiles.oncoming.values[0] == 0.0


def test_a_limit_out_of_reach_leaves_the_best_calibration() -> None:
    found = calibrate(make_coarse((Limit(Metric.SHIFT_TIME, 0.05),)))
    old, new = (one.certificate.limits[0] for one in (found.before, found.after))
    assert new.value < old.value
    assert new.state.name == "EXCEEDED"


def test_points_of_a_front_have_the_figures_of_fresh_draws(found: Calibration) -> None:
    front, task = trace_front(found), found.task
    assert front.tried == 14
    draws = draw(task, task.settings.neighbour_fresh_draws, "CERTIFICATE")
    for one in front.points[:3]:
        outcome = make_plant(task.maneuver).evaluate(task.policy.build_control(one.values), draws)
        assert one.jerk == pytest.approx(np.quantile(outcome.values[Metric.PEAK_JERK], 0.95))
        assert one.energy == pytest.approx(outcome.values[Metric.FRICTION_ENERGY].mean())
    assert [one.time for one in front.points] == sorted(one.time for one in front.points)


def test_values_between_the_points_of_a_map_are_linear(found: Calibration) -> None:
    grid, task = Grid((1000.0, 1400.0), (165.0, 185.0)), found.task
    limits = (Limit(Metric.SHIFT_TIME, 1.2),)
    mapped = calibrate_map(
        lambda at: make_task(torque=at.engine_torque, speed=at.engine_speed, limits=limits), grid
    )
    assert set(mapped.points) == {(0, 0), (0, 1), (1, 0), (1, 1)}
    for place, one in mapped.points.items():
        assert one.task.maneuver.point == grid.get_point(place)
        assert one.jerk > 0.0
    middle = replace(task.maneuver.point, engine_torque=1200.0, engine_speed=175.0)
    corners = [one.found.values for one in mapped.points.values()]
    assert mapped.interpolate(middle) == pytest.approx(np.mean(corners, axis=0))
    corner = replace(middle, engine_torque=1000.0, engine_speed=185.0)
    assert mapped.interpolate(corner) == pytest.approx(mapped.points[0, 1].found.values)
    (centre,) = mapped.between
    assert centre.task.maneuver.point == middle
    with pytest.raises(InputError, match="outside the map"):
        mapped.interpolate(replace(middle, engine_torque=999.0))
