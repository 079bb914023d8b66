# SPDX-License-Identifier: MIT
"""Pressures from commands: through the actuators of a twin, on its own log without pressures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import drivetwin
from drivetwin.actuator.identify import IdentifiedActuator
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.cli import main
from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.twin.build import build_twin
from drivetwin.twin.twin import Twin
from tests.report.sample import card, identification


@pytest.fixture(scope="module")
def bench() -> DynoRun:
    return run(load_scenario("hydraulics"), seed=4)


@pytest.fixture(scope="module")
def log(bench: DynoRun) -> ShiftLog:
    return ShiftLog({one.role: one for one in bench.channels}, "made.csv", "0" * 64)


@pytest.fixture(scope="module")
def twin(bench: DynoRun) -> Twin:
    made = {n: IdentifiedActuator.from_design(m) for n, m in bench.truth.actuators.items()}
    return replace(build_twin(identification(), card()), actuators=made)


def test_a_log_without_pressures_is_simulated_from_its_commands(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, card_file, _ = write_run(tmp_path / "a.csv", run(load_scenario("hydraulics"), seed=1))
    made = drivetwin.load_card(card_file)
    recording = drivetwin.read_log(file, made)
    found = drivetwin.identify(recording, made, drivetwin.detect_shifts(recording, made))
    drivetwin.save_twin(tmp_path / "twin.toml", build_twin(found, made))
    other = run(load_scenario("hydraulics"), seed=2)
    kept = tuple(c for c in other.channels if not c.role.startswith("pressure."))
    bare, _, _ = write_run(tmp_path / "b.csv", replace(other, channels=kept))
    arguments = ["simulate", str(tmp_path / "twin.toml"), str(bare)]
    assert main([*arguments, "--from-command"]) == 0
    captured = capsys.readouterr()
    assert "pressures of B2, B3 from their commands" in captured.err
    assert "completed" in captured.out
    assert main(arguments) != 0
    traces = tmp_path / "traces.csv"
    assert main([*arguments, "--from-command", "-o", str(traces)]) == 0
    columns = np.genfromtxt(traces, delimiter=",", names=True, skip_header=0)[1:]
    exact = np.interp(columns["time"], other.trajectory.time, other.trajectory.shaft_torque)
    assert np.sqrt(np.nanmean((columns["output_torque_simulated"] - exact) ** 2)) < 60.0
