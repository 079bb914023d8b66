# SPDX-License-Identifier: MIT
"""Pressures from commands: through the actuators of a twin, on its own log without pressures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import drivetwin
from drivetwin.cli import main
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.logs.read import read_raw
from drivetwin.logs.write import write_log


def test_a_log_without_pressures_is_simulated_from_its_commands(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for seed in (1, 2):
        synth = ["synth", "--scenario", "hydraulics", "--seed", str(seed)]
        assert main([*synth, "-o", str(tmp_path / f"{seed}.csv")]) == 0
    made = drivetwin.load_card(tmp_path / "1.card.toml")
    recording = drivetwin.read_log(tmp_path / "1.csv", made)
    found = drivetwin.identify(recording, made, drivetwin.detect_shifts(recording, made))
    drivetwin.save_twin(tmp_path / "twin.toml", drivetwin.build_twin(found, made))
    raw, bare = read_raw(tmp_path / "2.csv"), tmp_path / "bare.csv"
    write_log(bare, [one for one in raw.channels if one.name not in ("PrsBrk2", "PrsBrk3")])
    other = run(load_scenario("hydraulics"), seed=2)
    capsys.readouterr()
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
