# SPDX-License-Identifier: MIT
"""`drivetwin observe` writes what it tells, in every table format."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from drivetwin.cli import main
from drivetwin.cli.observe import collect_channels
from drivetwin.logs.read import read_raw
from drivetwin.observer.linear_model import Band, Observation
from tests.observer.conftest import Bench, bench
from tests.shifts.test_shift_split_gears import CHAIN

__all__ = ["bench"]


def test_writes_torques_with_their_deviation(
    bench: Bench, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    twin, log = map(str, bench.files)
    files = [tmp_path / f"torques{end}" for end in (".csv", ".parquet", ".mf4", ".mat", ".html")]
    outputs = [word for file in files for word in ("-o", str(file))]
    assert main(["observe", twin, log, *outputs, "--json"]) == 0
    (shift,) = json.loads(capsys.readouterr().out)["shifts"]
    assert shift["torques"]["output_torque"]["highest"] > 4000.0
    assert "95 % band" in files[-1].read_text(encoding="utf-8")
    for file in files[:-1]:
        columns = {channel.name: channel for channel in read_raw(file).channels}
        dot = "_" if file.suffix == ".mat" else "."
        names = ("output_torque", f"torque{dot}B2", f"torque{dot}B3")
        assert set(columns) == {name + end for name in names for end in ("", "_std")}
        torque = columns["output_torque"]
        exact = np.interp(torque.time, bench.motion.time, bench.motion.shaft_torque)
        assert np.sqrt(np.mean((torque.values - exact) ** 2)) < 20.0
        assert (columns["output_torque_std"].values > 0.0).all()


@pytest.mark.parametrize("command", ["observe", "simulate"])
def test_faults_of_the_log_stand_beside_the_result(
    bench: Bench, tmp_path: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    twin, whole = bench.files
    head, units, *rows = whole.read_text(encoding="utf-8").splitlines()
    place = head.split(",").index("EngTrq")
    cells = [row.split(",") for row in rows]
    for row in cells:
        if 0.3 < float(row[0]) < 0.5:
            row[place] = ""
    log = tmp_path / "log.csv"
    log.write_text("\n".join([head, units, *map(",".join, cells)]) + "\n", encoding="utf-8")
    assert main([command, str(twin), str(log), "--json"]) == 0
    texts = [one["text"] for one in json.loads(capsys.readouterr().out)["findings"]]
    assert any("'EngTrq': No samples from 0.3" in text for text in texts)
    assert main([command, str(twin), str(log)]) == 0
    assert "'EngTrq': No samples from 0.3" in capsys.readouterr().out


def test_time_increases_from_shift_to_shift() -> None:
    """The gear between two shifts is observed with both of them."""
    found = []
    for level, shift in enumerate(CHAIN):
        time = np.arange(shift.before[0], shift.after[1] + 0.25, 0.5)
        band = Band(np.full(time.size, float(level)), np.ones(time.size))
        found.append(Observation(shift, time, band, {"B2": band}))
    channels = {channel.name: channel for channel in collect_channels(found)}
    assert set(channels) == {"output_torque", "output_torque_std", "torque.B2", "torque.B2_std"}
    for channel in channels.values():
        assert (np.diff(channel.time) > 0.0).all()
    torque = channels["torque.B2"]
    assert np.array_equal(torque.values, np.searchsorted([5.0, 10.0], torque.time, side="right"))
