# SPDX-License-Identifier: MIT
"""Effects in the output torque sensor leave the motion and all other channels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.errors import InputError
from tests.support.arrays import FloatArray

SCENARIO = load_scenario("paper_steps")


def record(effects: Mapping[str, float], seed: int = 1) -> DynoRun:
    return run(SCENARIO, seed, noise=0.0, effects=effects)


def read(bench: DynoRun, role: str) -> FloatArray:
    return next(channel.values for channel in bench.channels if channel.role == role)


@pytest.fixture(scope="module")
def nominal() -> DynoRun:
    return record({})


@pytest.mark.parametrize("name", ["offset", "drift", "delay"])
def test_only_the_output_torque_changes(name: str, nominal: DynoRun) -> None:
    bench = record({f"output_torque_{name}": 0.01})
    for channel, other in zip(bench.channels, nominal.channels, strict=True):
        same = np.array_equal(channel.values, other.values)
        assert same == (channel.role != "output_torque")


def test_the_offset_is_a_share_of_the_largest_shaft_torque(nominal: DynoRun) -> None:
    error = read(record({"output_torque_offset": 0.01}), "output_torque")
    error = error - read(nominal, "output_torque")
    full = np.max(np.abs(nominal.trajectory.shaft_torque))
    assert np.allclose(error, 0.01 * full, rtol=1e-3)


def test_the_drift_has_its_spread_after_five_seconds_and_no_mean(nominal: DynoRun) -> None:
    full = np.max(np.abs(nominal.trajectory.shaft_torque))
    ends = []
    for seed in range(40):
        drift = read(record({"output_torque_drift": 0.01}, seed), "output_torque")
        drift = drift - read(nominal, "output_torque")
        assert abs(np.mean(drift)) < 1e-4 * full
        ends.append((drift[-1] - drift[0]) / full)
    # Length 5 s; the standard deviation of 40 draws lies within 30 % in 99 of 100 cases.
    assert np.std(ends) == pytest.approx(0.01, rel=0.3)


def test_a_sample_is_older_by_the_delay(nominal: DynoRun) -> None:
    late = read(record({"output_torque_delay": 0.003}), "output_torque")
    assert np.allclose(late[3:], read(nominal, "output_torque")[:-3], atol=1e-6)


def test_an_absent_sensor_is_refused() -> None:
    sensors = tuple(each for each in SCENARIO.sensors if each.role != "output_torque")
    with pytest.raises(InputError, match="no output torque"):
        run(replace(SCENARIO, sensors=sensors), effects={"output_torque_offset": 0.01})


def test_a_whole_gearbox_takes_sensor_effects() -> None:
    bench = run(load_scenario("gearbox"), noise=0.0, effects={"output_torque_offset": 0.01})
    assert bench.truth.effects == {"output_torque_offset": 0.01}
