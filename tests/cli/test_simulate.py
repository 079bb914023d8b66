# SPDX-License-Identifier: MIT
"""`drivetwin simulate -o` writes the traces of all shifts as one log."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.cli import main
from drivetwin.estimation.result.validation import Validation
from drivetwin.logs.read import read_raw
from drivetwin.shifts.shift import Shift
from drivetwin.validation.simulate_log import format_signals, simulate_shift
from tests.observer.conftest import Bench, bench
from tests.shifts.test_shift_split_gears import CHAIN

__all__ = ["bench"]


def test_traces_are_those_of_the_run_beside_the_measurement(bench: Bench, tmp_path: Path) -> None:
    twin, log = map(str, bench.files)
    file = tmp_path / "traces.csv"
    assert main(["simulate", twin, log, "-o", str(file)]) == 0
    read = {channel.name: channel for channel in read_raw(file).channels}
    units = {name: channel.unit for name, channel in read.items()}
    assert units["output_torque_simulated"] == "N*m"
    assert units["input_speed_measured"] == units["wheel_speed_simulated"] == "rad/s"
    torque = read["output_torque_simulated"]
    exact = np.interp(torque.time, bench.motion.time, bench.motion.shaft_torque)
    assert np.sqrt(np.mean((torque.values - exact) ** 2)) < 80.0
    ratio = read["input_speed_simulated"].values / read["output_speed_simulated"].values
    held = bench.twin.get_gear(bench.shift.start_gear).ratio
    assert ratio[0] == pytest.approx(held, rel=1e-9)
    for name in bench.log.channels.keys() & {"output_torque", "input_speed", "wheel_speed"}:
        column = read[f"{name}_measured"]
        expected = bench.log[name].interpolate(column.time)
        assert np.nanmax(np.abs(column.values / expected - 1.0)) < 1e-6


def test_a_page_compares_both(bench: Bench, tmp_path: Path) -> None:
    twin, log = map(str, bench.files)
    page = tmp_path / "page.html"
    assert main(["simulate", twin, log, "-o", str(page)]) == 0
    text = page.read_text(encoding="utf-8")
    assert "Simulation of" in text
    assert "Shift by shift" in text
    assert "measured" in text
    assert main(["simulate", twin, log, "-o", log]) == 2


@pytest.mark.parametrize("command", ["simulate", "observe"])
def test_swapped_arguments_are_named(
    command: str, bench: Bench, capsys: pytest.CaptureFixture[str]
) -> None:
    twin, log = map(str, bench.files)
    assert main([command, log, twin]) == 2
    error = capsys.readouterr().err
    assert f"{log}: this is a log, not a twin" in error
    assert "first" in error
    assert main([command, twin, twin]) == 2
    assert f"{twin}: this is a twin, not a log" in capsys.readouterr().err


def test_time_increases_from_shift_to_shift(bench: Bench, tmp_path: Path) -> None:
    """The gear between two shifts is simulated with both of them."""
    run = simulate_shift(bench.twin, bench.log, bench.shift)
    runs = [_as(run, shift) for shift in CHAIN[:2]]
    file = tmp_path / "traces.csv"
    file.write_text(format_signals(runs, bench.log), encoding="utf-8")
    (torque,) = (one for one in read_raw(file).channels if one.name == "output_torque_simulated")
    assert (np.diff(torque.time) > 0.0).all()
    one, other = (each.trajectory for each in runs)
    assert (torque.time[0], torque.time[-1]) == (one.time[0], other.time[-1])
    for motion, part in ((one, torque.time < 5.0), (other, torque.time >= 5.0)):
        expected = np.interp(torque.time[part], motion.time, motion.shaft_torque)
        assert np.allclose(torque.values[part], expected, rtol=1e-6)  # of times with 12 digits


def _as(run: Validation, shift: Shift) -> Validation:
    """The run with its motion spread over the times of another shift."""
    time = np.linspace(shift.before[0], shift.after[1], run.trajectory.time.size)
    return replace(run, shift=shift, trajectory=replace(run.trajectory, time=time))
