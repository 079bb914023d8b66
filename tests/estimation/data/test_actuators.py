# SPDX-License-Identifier: MIT
"""Actuators from logs: which elements, and what is reported of the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.actuator.model import QUANTITIES
from drivetwin.channels.pressure_roles import make_command_role, make_pressure_role
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.dyno.dyno import run
from drivetwin.dyno.names import ScenarioName
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.data.actuators import identify_actuators
from drivetwin.findings import Code
from tests.report.sample import card

BENCH = run(load_scenario(ScenarioName.HYDRAULICS), seed=3)


@pytest.fixture
def log() -> ShiftLog:
    return ShiftLog({one.role: one for one in BENCH.channels}, "made.csv", "0" * 64)


def test_commands_and_pressures_give_the_true_actuator(log: ShiftLog) -> None:
    found, findings = identify_actuators([log], card())
    truth = BENCH.truth.actuators
    assert set(found) == set(truth) == {"B2", "B3"}
    for name in ("dead_time", "falling_lag", "damping"):
        one = found["B3"]
        error = getattr(one.model, name) - getattr(truth["B3"], name)
        assert abs(error) < 4.0 * one.std[list(QUANTITIES).index(name)]
    assert found["B3"].model.kiss_pressure == pytest.approx(truth["B3"].kiss_pressure, rel=0.03)
    assert abs(found["B2"].model.dead_time - truth["B2"].dead_time) < 2e-3
    assert [(one.code, one.subject) for one in findings] == [(Code.ACTUATOR_UNDETERMINED, "B2")]
    assert "fill time" in findings[0].text


def test_without_a_command_there_is_none(log: ShiftLog) -> None:
    channels = {role: one for role, one in log.channels.items() if "command" not in role}
    assert identify_actuators([replace(log, channels=channels)], card()) == ({}, ())


def test_a_command_of_another_clutch_is_reported(log: ShiftLog) -> None:
    command, pressure = log[make_command_role("B3")], log[make_pressure_role("B3")]
    reversed_ = replace(pressure, values=pressure.values[::-1].copy())
    channels = {command.role: command, pressure.role: reversed_}
    found, findings = identify_actuators([replace(log, channels=channels)], card())
    assert found == {}
    assert [one.code for one in findings] == [Code.ACTUATOR_NOT_IDENTIFIED]
    assert "pressure_command.B3" in findings[0].text


def test_values_that_are_missing_are_left_out(log: ShiftLog) -> None:
    role = make_command_role("B3")
    gone = log[role].values.copy()
    gone[:3] = np.nan
    holed = replace(log[role], values=gone)
    pressure = make_pressure_role("B3")
    channels = {role: holed, pressure: log[pressure]}
    found, _ = identify_actuators([replace(log, channels=channels)], card())
    assert set(found) == {"B3"}
