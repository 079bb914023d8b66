# SPDX-License-Identifier: MIT
"""The whole gearbox on the dynamometer against its dual-clutch form."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin.dyno import ScenarioName
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario import build_plant
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.errors import ReductionError
from drivetwin.gearbox import load_gearbox, solve_gear
from drivetwin.simulation.dual_clutch import Trajectory
from tests.support.arrays import FloatArray


def both(scenario: Any) -> tuple[Trajectory, Trajectory]:
    """Whole gearbox and form on the same inputs."""
    whole = run(scenario, noise=0.0).trajectory
    form = run(replace(scenario, plant=None), noise=0.0).trajectory
    return whole, form


def difference(a: FloatArray, b: FloatArray) -> float:
    return float(np.max(np.abs(a - b)) / np.max(np.abs(a)))


@pytest.mark.parametrize("name", [ScenarioName.GEARBOX, ScenarioName.GEARBOX_CHAIN])
@pytest.mark.parametrize("drum", [0.0, 0.2])
def test_brake_drums_are_the_drums_of_the_form(name: ScenarioName, drum: float) -> None:
    whole, form = both(load_scenario(name, drum))
    assert difference(whole.shaft_torque, form.shaft_torque) < 1e-9
    assert difference(whole.engine_speed, form.engine_speed) < 1e-9
    for element in form.slip:
        assert difference(whole.slip[element], form.slip[element]) < 1e-8
        assert difference(whole.clutch_torque[element], form.clutch_torque[element]) < 1e-8
    times = [np.array([event.time for event in each.events]) for each in (whole, form)]
    assert np.abs(times[0] - times[1]).max() < 1e-9


def test_inertia_of_a_gear_is_the_kinetic_energy_of_its_members() -> None:
    """2·E/ω_in² of all members but the open drums, the engine's counted η times."""
    scenario = load_scenario(ScenarioName.GEARBOX_CHAIN)
    assert scenario.plant is not None
    box, model = scenario.plant.gearbox, scenario.model
    truth = run(scenario, noise=0.0).truth.parameters
    for gear in ("2", "3", "4"):
        speeds = solve_gear(box, gear).speeds
        members = sum(
            inertia * (speeds[member] or 0.0) ** 2
            for member, inertia in box.inertias.items()
            if member not in ("R1", "R2-C1")
        )
        expected = members + model.eta * model.J1
        assert truth[f"J_prime_{gear}"] == pytest.approx(expected, rel=1e-12)


def test_what_is_simulated_starts_without_a_jerk() -> None:
    trajectory = run(load_scenario(ScenarioName.GEARBOX), noise=0.0).trajectory
    early = trajectory.shaft_torque[trajectory.time < 0.25]
    assert np.ptp(early) < 5e-3 * early.mean()


def test_double_transitions_have_no_plant() -> None:
    with pytest.raises(ReductionError, match="not one element off and one on"):
        build_plant(load_gearbox("three-set-4000cr"), ("2", "5"))
