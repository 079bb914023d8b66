# SPDX-License-Identifier: MIT
"""Whole calibrations, small: better than the start, reproducible, within limits."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin.calibration.calibrate import Calibration, Task, calibrate, compute_lower_bound
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.objective import Limit
from drivetwin.calibration.options import PolicyKind
from tests.calibration.cases import QUICK, SHIFTS, make_task

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


def test_no_draw_is_below_the_bound_of_a_steady_change_of_acceleration(found: Calibration) -> None:
    """The best relaxed shift changes the acceleration evenly from request to lock-up."""
    shift = found.task.maneuver
    old, new = (shift.compute_acceleration(1400.0, ratio) for ratio in shift.ratios)
    change = shift.wheel_radius / shift.model.i_f * abs(old - new)
    assert found.bound is not None
    assert found.bound == pytest.approx(change / 0.95, rel=0.02)
    assert found.bound < found.after.outcome.values[Metric.PEAK_JERK].min()
    no_time = [Limit(Metric.SHIFT_TIME, 0.3), Limit(Metric.TORQUE_REDUCTION, 10.0)]
    later = compute_lower_bound(shift, no_time)
    assert later is not None
    assert later > 2.0 * found.bound


@pytest.mark.parametrize("kind", [PolicyKind.CONTROLLER, PolicyKind.KNOTS])
def test_an_inertia_phase_that_comes_first_is_calibrated(kind: PolicyKind) -> None:
    settings = replace(QUICK, search_iterations=8)
    found = calibrate(make_coarse(shift="power-on downshift", policy=kind, settings=settings))
    assert compare_jerk(found) < 0.9
    assert found.after.certificate.unlocked == 0
