# SPDX-License-Identifier: MIT
"""The driveline behind an open converter is the dual clutch, driven by the turbine."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.simulation.added_elements import AddedElements
from drivetwin.simulation.driveline_run import DrivelineTask, simulate
from drivetwin.simulation.dual_clutch import DualClutch, Signal, Trajectory
from drivetwin.vehicle.card import load_card
from tests.support.synth import synthesize


def test_the_turbine_torque_moves_the_dual_clutch_as_the_converter_does() -> None:
    made = run(load_scenario("open_converter"), noise=0.0)
    scenario, motion = made.scenario, made.trajectory
    assert scenario.converter is not None
    crank = next(each for each in made.channels if each.role == "engine_speed")
    turbine = np.interp(crank.time, motion.time, motion.engine_speed)
    torque = scenario.converter.converter.compute_turbine_torque(crank.values, turbine)
    pressures = {
        name: Signal(crank.time, actuator.compute_pressure(crank.time))
        for name, actuator in scenario.actuators.items()
    }
    alone = simulate(
        scenario.model, Signal(crank.time, torque), pressures, scenario.start(), crank.time
    )
    # The torque is linear between 1 kHz samples in one run and not in the other.
    for name, size in (("engine_speed", 2e-3), ("output_speed", 1e-3), ("shaft_torque", 1.0)):
        expected = np.interp(crank.time, motion.time, getattr(motion, name))
        assert getattr(alone, name) == pytest.approx(expected, abs=size), name


def test_all_inertias_of_the_model_turn_behind_the_converter() -> None:
    scenario = load_scenario("open_converter")
    assert scenario.converter is not None
    model = replace(scenario.model, eta=1.0, i_in=1.2, J1=2.0, J2e=1.5)
    time = np.linspace(0.0, 0.5, 501)
    ends = np.array([0.0, 0.5])
    held = {
        each.name: Signal(ends, np.full(2, 1.5e6 if each.name in scenario.start().locked else 0.0))
        for each in model.elements
    }
    torque = Signal(np.array([0.0, 0.1, 0.5]), np.array([1545.0, 1545.0, 800.0]))
    start = replace(scenario.start(), engine_speed=1.2 * scenario.start().engine_speed)
    added = AddedElements(front=scenario.converter)

    def simulate_behind(model: DualClutch) -> Trajectory:
        return DrivelineTask(model, added, torque, held, start, time).simulate()

    ran = simulate_behind(model)
    # Without losses it is all one on which side of the input gear an inertia turns.
    before = replace(model, J1=3.5, J2e=0.0)
    same = simulate_behind(before)
    assert ran.status == same.status == "completed"
    assert ran.engine_speed == pytest.approx(same.engine_speed, abs=1e-6)
    lighter = simulate_behind(replace(model, J2e=0.0))
    assert np.max(np.abs(lighter.engine_speed - ran.engine_speed)) > 0.01


def test_the_card_has_the_map(tmp_path: Path) -> None:
    scenario = load_scenario("open_converter")
    _, card, _ = synthesize(tmp_path / "open.csv", "open_converter")
    found = load_card(card).converter
    assert scenario.converter is not None
    assert found is not None
    expected = scenario.converter.converter
    assert found.speed_ratio == expected.speed_ratio
    assert found.capacity == pytest.approx(expected.capacity)
