# SPDX-License-Identifier: MIT
"""Shifts of the whole gearbox: phases, hydraulics, torque intervention."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from drivetwin.dyno import ScenarioName
from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.dyno.scenario_file import load_scenario


@pytest.fixture(scope="module", params=[ScenarioName.GEARBOX, ScenarioName.GEARBOX_CHAIN])
def bench(request: pytest.FixtureRequest) -> DynoRun:
    return run(load_scenario(request.param), noise=0.0)


def test_each_shift_has_its_phases_in_order(bench: DynoRun) -> None:
    shifts = bench.truth.shifts
    assert [(s.start_gear, s.end_gear) for s in shifts] == list(
        pairwise(gear.name for gear in bench.scenario.gears)
    )
    for shift in shifts:
        assert shift.torque_start is not None
        assert shift.inertia_start is not None
        assert shift.lockup is not None
        assert 0.05 < shift.inertia_start - shift.torque_start < 0.25
        assert 0.25 < shift.lockup - shift.inertia_start < 0.7


def test_gears_are_held_between_the_shifts(bench: DynoRun) -> None:
    motion, scenario = bench.trajectory, bench.scenario
    ends = [*(s.torque_start for s in bench.truth.shifts), scenario.duration]
    begins = [0.0, *(s.lockup for s in bench.truth.shifts)]
    for gear, begin, end in zip(scenario.gears, begins, ends, strict=True):
        assert begin is not None
        assert end is not None
        held = (motion.time > begin) & (motion.time < end)
        ratio = motion.engine_speed[held] / motion.output_speed[held]
        assert np.abs(ratio / scenario.get_ratio(gear.element) - 1.0).max() < 1e-9


def test_the_on_coming_element_fills_before_it_carries(bench: DynoRun) -> None:
    """The pressure stays below P0 while the piston moves, although the valve is at boost."""
    scenario = bench.scenario
    actuator: Any = scenario.actuators[scenario.oncoming]
    time = np.arange(round(1000 * scenario.duration)) / 1000.0
    pressure, asked = actuator.compute_pressure(time), actuator.command.evaluate(time)
    start = bench.truth.torque_start
    assert start is not None
    before = (time > start - 0.15) & (time < start)
    assert asked[before].max() == pytest.approx(actuator.fill.boost)
    assert 6.5e4 < pressure[before].max() <= 8.0e4


def test_torque_intervention_acts_in_every_shift() -> None:
    scenario = load_scenario(ScenarioName.GEARBOX_CHAIN)
    plain, cut = (run(each, noise=0.0) for each in (scenario, scenario.set_torque_reduction(0.3)))
    for whole, reduced in zip(plain.truth.shifts, cut.truth.shifts, strict=True):
        assert whole.lockup is not None
        assert reduced.lockup is not None
        assert reduced.lockup < whole.lockup - 0.02
