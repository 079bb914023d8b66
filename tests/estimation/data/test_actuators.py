# SPDX-License-Identifier: MIT
"""Hydraulics of the clutches from commands and pressures of a log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.method import Method
from drivetwin.findings import Code
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from tests.report.sample import card
from tests.support.arrays import FloatArray

BENCH = run(load_scenario("hydraulics"), seed=3)
LOG = ShiftLog({one.role: one for one in BENCH.channels}, "made.csv", "0" * 64)
COMMAND, PRESSURE = "pressure_command.B3", "pressure.B3"
CODES = {Code.ACTUATOR_UNDETERMINED, Code.ACTUATOR_NOT_IDENTIFIED}


def _identify(**changed: FloatArray) -> tuple[Identification, list[tuple[Code, str, str]]]:
    """Identify with changed values of channels by role; also code, subject and text of findings."""
    channels = {
        **LOG.channels,
        **{role: replace(LOG[role], values=values) for role, values in changed.items()},
    }
    log = replace(LOG, channels=channels)
    found = identify(log, card(), detect_shifts(log, card()), Method.PAPER)
    return found, [(o.code, o.subject, o.text) for o in found.findings if o.code in CODES]


def test_commands_and_pressures_give_the_true_actuator() -> None:
    """Values of a command that are missing are left out."""
    gone = LOG[COMMAND].values.copy()
    gone[:3] = np.nan
    found, findings = _identify(**{COMMAND: gone})
    one, truth = found.actuators["B3"], BENCH.truth.actuators["B3"]
    times = [0, 2, 3]  # dead time, lag of a falling pressure, damping
    assert np.all(np.abs(one.model.values - truth.values)[times] < 4.0 * one.std[times])
    assert one.model.kiss_pressure == pytest.approx(truth.kiss_pressure, rel=0.03)
    other = found.actuators["B2"].model.dead_time - BENCH.truth.actuators["B2"].dead_time
    assert abs(other) < 2e-3
    ((code, subject, text),) = findings
    assert (code, subject) == (Code.ACTUATOR_UNDETERMINED, "B2")
    assert "fill time" in text


def test_a_command_of_another_clutch_is_reported() -> None:
    found, findings = _identify(**{COMMAND: LOG[COMMAND].values[::-1].copy()})
    assert "B3" not in found.actuators
    assert [COMMAND in text for code, _, text in findings if code is Code.ACTUATOR_NOT_IDENTIFIED]


@pytest.mark.statistical
def test_without_pressures_torques_determine_the_delay_of_the_oncoming_clutch() -> None:
    kept = {role: one for role, one in LOG.channels.items() if not role.startswith("pressure.")}
    log = replace(LOG, channels=kept)
    result = identify(log, card(), detect_shifts(log, card()))
    found, truth = result.actuators["B3"], BENCH.truth.actuators["B3"]
    assert (np.abs(found.model.values - truth.values) < 3.5 * found.std).all()
    assert Code.ACTUATOR_FROM_TORQUE in {one.code for one in result.findings}
