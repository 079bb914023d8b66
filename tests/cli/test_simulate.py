# SPDX-License-Identifier: MIT
"""`drivetwin simulate -o` writes the traces of all shifts as one log."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.cli import main
from drivetwin.cli.simulate import format_traces
from drivetwin.estimation.result.validation import Validation
from drivetwin.logs.read import read_raw
from drivetwin.shifts.shift import Shift
from drivetwin.validation.simulate_log import simulate_shift
from tests.observer.conftest import Bench, bench
from tests.shifts.test_split_gears import CHAIN

__all__ = ["bench"]


def test_traces_are_those_of_the_run(bench: Bench, tmp_path: Path) -> None:
    twin, log = map(str, bench.files)
    file = tmp_path / "traces.csv"
    assert main(["simulate", twin, log, "-o", str(file)]) == 0
    read = {channel.name: channel for channel in read_raw(file).channels}
    assert {name: channel.unit for name, channel in read.items()} == {
        "output_torque": "N*m", "input_speed": "rad/s", "output_speed": "rad/s",
    }  # fmt: skip
    torque = read["output_torque"]
    exact = np.interp(torque.time, bench.motion.time, bench.motion.shaft_torque)
    assert np.sqrt(np.mean((torque.values - exact) ** 2)) < 80.0
    ratio = read["input_speed"].values / read["output_speed"].values
    held = bench.twin.get_gear(bench.shift.start_gear).ratio
    assert ratio[0] == pytest.approx(held, rel=1e-9)


def test_time_increases_from_shift_to_shift(bench: Bench, tmp_path: Path) -> None:
    """The gear between two shifts is simulated with both of them."""
    run = simulate_shift(bench.twin, bench.log, bench.shift)
    runs = [_as(run, shift) for shift in CHAIN[:2]]
    file = tmp_path / "traces.csv"
    file.write_text(format_traces(runs), encoding="utf-8")
    torque = read_raw(file).channels[0]
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
