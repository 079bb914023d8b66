# SPDX-License-Identifier: MIT
"""Actuators from commands and pressures: made records, and the pipeline on a log."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.actuator import USUAL, make_actuator, record
from drivetwin.actuator.model import QUANTITIES, HeldSignal
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.errors import IdentificationError
from drivetwin.estimation.actuators import identify_actuator, identify_actuators
from drivetwin.estimation.data.actuators import PressureRecord
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.method import Method
from drivetwin.findings import Code
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.spec import PriorValue
from tests.report.sample import card
from tests.support.arrays import FloatArray
from tests.support.repeats import mark_repeats

NAMES = list(QUANTITIES)


@pytest.mark.parametrize("seed", mark_repeats([1, 2, 3], [1]))
def test_a_made_actuator_is_found_within_its_intervals(seed: int) -> None:
    random = np.random.default_rng([7, seed])
    actuator = make_actuator(random)
    found = identify_actuator([record(actuator, random)], USUAL)
    errors = found.model.values - actuator.model.values
    covered = np.abs(errors) <= 1.96 * found.std
    assert abs(errors[NAMES.index("dead_time")]) < 5e-3
    kiss = NAMES.index("kiss_pressure")
    assert abs(errors[kiss]) < 0.02 * actuator.model.kiss_pressure
    assert (np.abs(errors) < 4.5 * found.std).all()
    assert covered.sum() >= 4
    assert found.rms == pytest.approx(7e3, rel=0.1)


def test_without_noise_the_values_are_exact() -> None:
    random = np.random.default_rng(5)
    actuator = make_actuator(random)
    clean = record(actuator, random)
    exact = replace(clean, pressure=actuator.compute_pressure(clean.time))
    found = identify_actuator([exact], USUAL)
    assert found.model.values == pytest.approx(actuator.model.values, rel=1e-3, abs=1e-5)


def test_what_an_opening_leaves_open_has_its_usual_range() -> None:
    random = np.random.default_rng(6)
    made = record(make_actuator(random), random)
    after = made.time > 3.4
    one = PressureRecord(
        HeldSignal(made.command.time[340:], made.command.values[340:]),
        made.time[after],
        made.pressure[after],
    )
    P0 = PriorValue(1.1e5, 1e4)
    result = identify_actuators({"K1": [one]}, {"K1": P0})
    (finding,) = result.findings
    assert finding.code is Code.ACTUATOR_UNDETERMINED
    assert all(name in finding.text for name in ("kiss pressure", "fill time"))
    assert "dead time" not in finding.text
    found = result.actuators["K1"]
    values, std = (dict(zip(NAMES, one, strict=True)) for one in (found.model.values, found.std))
    assert std["dead_time"] < 2e-3
    assert std["fill_time"] == pytest.approx(0.1, rel=0.3)
    assert values["kiss_pressure"] == pytest.approx(P0.value, abs=5e4)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (
            lambda made: replace(made, command=HeldSignal(np.zeros(1), np.zeros(1))),
            "the command changes by less than",
        ),
        (
            lambda made: replace(made, pressure=made.pressure[::-1].copy()),
            "does not follow its command",
        ),
    ],
    ids=["command-at-rest", "other-clutch"],
)
def test_a_pressure_without_a_command_of_its_own_is_refused(
    change: Callable[[PressureRecord], PressureRecord], text: str
) -> None:
    random = np.random.default_rng(8)
    made = record(make_actuator(random), random)
    with pytest.raises(IdentificationError, match=text):
        identify_actuator([change(made)], USUAL)


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
