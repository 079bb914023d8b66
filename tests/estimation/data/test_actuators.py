# SPDX-License-Identifier: MIT
"""Actuators from logs: which elements, and what is reported of the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.actuator.identify import ActuatorSource
from drivetwin.actuator.model import QUANTITIES
from drivetwin.channels.roles import make_command_role, make_pressure_role
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.dyno.dyno import run
from drivetwin.dyno.names import ScenarioName
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.data.actuators import (
    FoundActuators,
    LogShifts,
    compute_pressure_channel,
    identify_actuators,
)
from drivetwin.findings import Code
from drivetwin.shifts.detect import detect_shifts
from tests.report.sample import card

BENCH = run(load_scenario(ScenarioName.HYDRAULICS), seed=3)


@pytest.fixture
def log() -> ShiftLog:
    return ShiftLog({one.role: one for one in BENCH.channels}, "made.csv", "0" * 64)


def _identify(log: ShiftLog) -> FoundActuators:
    return identify_actuators([LogShifts(log, ())], card())


def test_commands_and_pressures_give_the_true_actuator(log: ShiftLog) -> None:
    result = _identify(log)
    found, findings = result.actuators, result.findings
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
    result = _identify(replace(log, channels=channels))
    assert (dict(result.actuators), result.findings) == ({}, ())


def test_a_command_of_another_clutch_is_reported(log: ShiftLog) -> None:
    command, pressure = log[make_command_role("B3")], log[make_pressure_role("B3")]
    reversed_ = replace(pressure, values=pressure.values[::-1].copy())
    channels = {command.role: command, pressure.role: reversed_}
    result = _identify(replace(log, channels=channels))
    found, findings = result.actuators, result.findings
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
    found = _identify(replace(log, channels=channels)).actuators
    assert set(found) == {"B3"}


@pytest.mark.statistical
def test_without_pressures_torques_determine_the_delay_of_the_oncoming_clutch() -> None:
    kept = {one.role: one for one in BENCH.channels if not one.role.startswith("pressure.")}
    log = ShiftLog(kept, "made.csv", "0" * 64)
    known = card()
    result = identify_actuators([LogShifts(log, detect_shifts(log, known).shifts)], known)
    found, truth = result.actuators["B3"], BENCH.truth.actuators["B3"]
    assert found.source is ActuatorSource.TORQUE
    assert (np.abs(found.model.values - truth.values) < 3.5 * found.std).all()
    assert found.std[list(QUANTITIES).index("dead_time")] < 0.02
    assert Code.ACTUATOR_FROM_TORQUE in {one.code for one in result.findings}
    assert set(result.actuators) == {"B2", "B3"}
    pressure = compute_pressure_channel(log[make_command_role("B3")], found.model, "B3")
    measured = next(one for one in BENCH.channels if one.role == "pressure.B3")
    left = pressure.interpolate(measured.time) - measured.values
    shift = (measured.time > 2.2) & (measured.time < 2.6)
    assert np.sqrt(np.nanmean(left[shift] ** 2)) < 0.1 * np.ptp(measured.values[shift])
