# SPDX-License-Identifier: MIT
"""Policy with a closed slip loop: a start that shifts, a calibration behind actuators."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.calibration.calibrate import calibrate
from drivetwin.calibration.identified_range import simulate_nominal
from drivetwin.calibration.maneuver import Maneuver
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.objective import Limit
from drivetwin.calibration.policy import Space
from drivetwin.calibration.profiles import compute_nominal_profiles
from drivetwin.calibration.scenarios import Draw, Purpose, draw_scenarios
from drivetwin.calibration.spread import Spread
from drivetwin.calibration.units import UnitDraws
from tests.calibration.cases import (
    ACTUATOR,
    FILLING,
    make_downshift,
    make_draw,
    make_plant,
    make_slip_policy,
    make_slip_task,
    make_upshift,
)


@pytest.mark.parametrize("filling", [False, True])
@pytest.mark.parametrize("shift", [make_upshift(), make_downshift()])
def test_start_makes_the_shift(shift: Maneuver, filling: bool) -> None:
    policy = make_slip_policy(shift, FILLING if filling else ACTUATOR)
    space = Space(policy)
    run = simulate_nominal(shift, compute_nominal_profiles(shift, space.build_control(space.start)))
    assert run.status == "completed"
    assert abs(run.slip[shift.oncoming.name][-1]) < 1e-6
    assert run.engine_speed[-1] / run.output_speed[-1] == pytest.approx(shift.ratios[1], rel=1e-6)


def test_the_slip_loop_holds_its_reference_over_the_spread() -> None:
    shift = make_upshift()
    policy = make_slip_policy(shift)
    draw = Draw(make_draw(shift).driveline, UnitDraws(ACTUATOR, ACTUATOR, 0.05, Spread()))
    draws = draw_scenarios(shift, draw, 12, 1, Purpose.SEARCH)
    spreads = []
    for share in (0.0, 1.0):
        gains = {"gain": share * 4.0, "integral_gain": share * 4.0}
        values = np.array([gains.get(one.name, 1.0) * one.start for one in policy.parameters])
        outcome = make_plant(shift).evaluate(policy.build_control(values), draws)
        spreads.append(float(outcome.values[Metric.SHIFT_TIME].std()))
    assert spreads[1] < 0.8 * spreads[0]


def test_calibrates_behind_the_actuators() -> None:
    task = make_slip_task((Limit(Metric.SHIFT_TIME, 0.95),))
    found = calibrate(task)
    old, new = (
        one.certificate.quantiles[Metric.PEAK_JERK].share_95 for one in (found.before, found.after)
    )
    assert new < 0.9 * old
    assert found.after.certificate.draws == len(found.fresh.units)
    lagging = found.after.profiles.oncoming
    assert lagging.values[0] == 0.0
    assert lagging.time.size == task.maneuver.time.size


def test_drawn_units_have_the_stated_spread_and_covariance() -> None:
    covariance = np.zeros((7, 7))
    covariance[4, 4], covariance[6, 6] = 400.0, np.inf
    one = replace(FILLING, covariance=covariance)
    draws = UnitDraws(one, one, 0.05, Spread(kiss_pressure=0.0))
    random = np.random.default_rng(5)
    units = [draws(random)(random) for _ in range(3000)]
    dead = np.array([each.oncoming.dead_time for each in units])
    kiss = np.array([each.oncoming.kiss_pressure for each in units])
    assert dead.std() == pytest.approx(5e-3, rel=0.06)
    assert np.log([each.engine_lag for each in units]).std() == pytest.approx(0.15, rel=0.06)
    assert kiss.std() == pytest.approx(20.0, rel=0.06)
    assert {each.oncoming.hysteresis for each in units} == {one.model.hysteresis}
    assert all(each.offgoing.dead_time == each.oncoming.dead_time for each in units)
