# SPDX-License-Identifier: MIT
"""Shifts of other kinds do on the dynamometer what their names say."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.dyno.scenario import Scenario
from drivetwin.dyno.scenario_file import load_scenario


def _exact(scenario: Scenario) -> DynoRun:
    made = run(scenario, noise=0.0)
    shift = made.truth.shifts[0]
    assert shift.inertia_start is not None
    assert shift.lockup is not None
    return made


def _at(made: DynoRun, column: str, time: float) -> float:
    values = getattr(made.trajectory, column)
    return float(np.interp(time, made.trajectory.time, values))


@pytest.mark.parametrize("scenario", ["power_on_down", "power_off_down"])
def test_a_downshift_brings_the_engine_up(scenario: str) -> None:
    made = _exact(load_scenario(scenario))
    shift = made.truth.shifts[0]
    assert (shift.start_gear, shift.end_gear) == ("3", "2")
    start, end = shift.inertia_start or 0.0, shift.lockup or 0.0
    assert _at(made, "engine_speed", end) > 1.05 * _at(made, "engine_speed", start)


def test_in_a_kick_down_the_element_that_lets_go_carries_the_torque() -> None:
    made = _exact(load_scenario("power_on_down"))
    shift = made.truth.shifts[0]
    middle = (shift.inertia_start or 0.0) + 0.4
    motion = made.trajectory
    torques = {n: np.interp(middle, motion.time, t) for n, t in motion.clutch_torque.items()}
    assert torques["B3"] > 50.0
    assert torques["B2"] == 0.0


def test_with_the_power_off_the_engine_falls_before_the_upshift_takes_hold() -> None:
    made = _exact(load_scenario("power_off_up"))
    fill = made.truth.torque_start
    assert fill is not None
    assert fill > (made.truth.inertia_start or 0.0)
    demand = made.scenario.compute_torque(np.array([2.2]))
    assert demand[0] < 0.0


def test_an_input_gear_stands_between_engine_and_gearbox() -> None:
    made = _exact(load_scenario("input_gear"))
    speed = next(c for c in made.channels if c.role == "input_speed")
    expected = np.interp(speed.time, made.trajectory.time, made.trajectory.engine_speed) / 1.2
    assert speed.values == pytest.approx(expected, rel=1e-9)
    assert made.truth.parameters["J_prime_2"] > 0.85 * 17.0 + 2.2
