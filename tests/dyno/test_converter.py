# SPDX-License-Identifier: MIT
"""The driveline behind an open converter is the dual clutch, driven by the turbine."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivetwin.cli.synth import write_run
from drivetwin.driveline import Signal, simulate
from drivetwin.dyno.converter_scenario import open_converter
from drivetwin.dyno.dyno import run
from drivetwin.vehicle.card import load_card


def test_the_turbine_torque_moves_the_dual_clutch_as_the_converter_does() -> None:
    made = run(open_converter(), noise=0.0)
    scenario, motion = made.scenario, made.trajectory
    assert scenario.converter is not None
    crank = next(each for each in made.channels if each.role == "engine_speed")
    turbine = np.interp(crank.time, motion.time, motion.engine_speed)
    torque = scenario.converter.converter.turbine_torque(crank.values, turbine)
    pressures = {
        name: Signal(crank.time, actuator.pressure(crank.time))
        for name, actuator in scenario.actuators.items()
    }
    alone = simulate(
        scenario.model, Signal(crank.time, torque), pressures, scenario.start(), crank.time
    )
    # The torque is linear between 1 kHz samples in one run and not in the other.
    for name, size in (("engine_speed", 2e-3), ("output_speed", 1e-3), ("shaft_torque", 1.0)):
        expected = np.interp(crank.time, motion.time, getattr(motion, name))
        assert getattr(alone, name) == pytest.approx(expected, abs=size), name


def test_the_engine_starts_where_its_torque_is_steady() -> None:
    scenario = open_converter()
    assert scenario.converter is not None
    engine, turbine = scenario.converter.steady(1545.0, 140.0)
    assert scenario.converter.converter.pump_torque(engine, 140.0) == pytest.approx(1545.0)
    assert turbine > 1545.0


def test_the_card_has_the_map(tmp_path: Path) -> None:
    scenario = open_converter()
    _, card, _ = write_run(tmp_path / "open.csv", run(scenario, seed=0))
    found = load_card(card).converter
    assert scenario.converter is not None
    assert found is not None
    expected = scenario.converter.converter
    assert found.speed_ratio == expected.speed_ratio
    assert found.capacity == pytest.approx(expected.capacity)
