# SPDX-License-Identifier: MIT
"""Front of a calibration: which points remain, and that they are what they say."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.calibration.calibrate import Calibration, calibrate, draw_for
from drivetwin.calibration.evaluate import Plant
from drivetwin.calibration.front import Arm, FrontPoint, select_nondominated, trace_front
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.objective import Limit
from drivetwin.calibration.policy import Space
from drivetwin.calibration.scenarios import Purpose
from tests.calibration.cases import make_task

SIZE = st.floats(1.0, 100.0)
LIMIT = Limit(Metric.VIBRATION_DOSE, 1.0)


def make_point(jerk: float, energy: float, time: float, *exceeded: Limit) -> FrontPoint:
    return FrontPoint(Arm.TIME, np.zeros(1), jerk, energy, time, exceeded)


def test_dominated_and_equal_points_and_those_beyond_a_limit_are_left_out() -> None:
    best, quick, worse = make_point(40, 40, 0.7), make_point(60, 40, 0.6), make_point(61, 41, 0.65)
    equal, beyond = make_point(40.001, 40, 0.7), make_point(10, 10, 0.1, LIMIT)
    assert select_nondominated([best, quick, worse, equal, beyond]) == [best, quick]


@given(st.lists(st.tuples(SIZE, SIZE, SIZE), min_size=1, max_size=12))
def test_no_remaining_point_is_worse_than_another(
    figures: list[tuple[float, float, float]],
) -> None:
    kept = select_nondominated([make_point(*one) for one in figures])
    assert kept
    for one in kept:
        for other in kept:
            if one is not other:
                assert (other.figures > one.figures).any()


@pytest.fixture(scope="module")
def found() -> Calibration:
    return calibrate(make_task((Limit(Metric.SHIFT_TIME, 1.0),)))


def test_points_have_the_figures_of_fresh_draws(found: Calibration) -> None:
    front, again = trace_front(found), trace_front(found)
    assert front.tried == 14
    assert front.runs == again.runs > 0
    assert [one.jerk for one in front.points] == [one.jerk for one in again.points]
    task = found.task
    draws = draw_for(task, task.settings.neighbour_fresh_draws, Purpose.CERTIFICATE)
    space = Space(task.policy)
    for one in front.points[:3]:
        profiles = space.build_control(space.to_coordinates(one.values))
        outcome = Plant(task.maneuver, 1).evaluate(profiles, draws)
        assert one.jerk == pytest.approx(np.quantile(outcome.values[Metric.PEAK_JERK], 0.95))
        assert one.energy == pytest.approx(outcome.values[Metric.FRICTION_ENERGY].mean())
    assert [one.time for one in front.points] == sorted(one.time for one in front.points)
