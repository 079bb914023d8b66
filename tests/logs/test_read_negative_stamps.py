# SPDX-License-Identifier: MIT
"""Stamps below zero, as loggers with a pre-trigger write them, in every format."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from drivetwin.logs.raw import RawChannel
from drivetwin.logs.read import read_log, read_raw
from drivetwin.logs.write import write_log
from drivetwin.shifts.detect import detect_shifts
from tests.logs.fixtures import UNITS, card, columns

BEFORE = -1.5
"""Time [s] of the first sample."""


def channels() -> list[RawChannel]:
    table = columns()
    time = np.round(table.pop("time") + BEFORE, 3)
    return [RawChannel(name, UNITS[name], time, values) for name, values in table.items()]


@pytest.mark.parametrize("suffix", [".csv", ".mf4", ".mat", ".parquet"])
def test_measurement_files(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"log{suffix}"
    write_log(path, channels())
    log = read_log(path, card(tmp_path))
    time = log["input_speed"].time
    assert (time[0], time[-1]) == (BEFORE, pytest.approx(BEFORE + 1.99))
    assert log.findings == ()


def test_the_shift_is_found_so_much_earlier(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    begins = []
    for shift in (0.0, BEFORE):
        write_log(
            path,
            [RawChannel(c.name, c.unit, c.time - BEFORE + shift, c.values) for c in channels()],
        )
        vehicle = card(tmp_path)
        (found,) = detect_shifts(read_log(path, vehicle), vehicle).shifts
        begins.append(found.inertia_phase[0])
    assert begins[1] == pytest.approx(begins[0] + BEFORE, abs=1e-6)


def line(form: str, place: int, time: float, data: bytes) -> str:
    text = data.hex(" ").upper()
    return {
        "candump": f" ({time:.6f})  can0  0CF00203   [8]  {text}",
        "candump-L": f"({time:.6f}) can0 0CF00203#{data.hex()}",
        "asc": f" {time:.6f} 1  CF00203x       Rx   d 8 {text}",
        "trc": f"{place + 1:7})   {time * 1e3:.1f}  Rx     0CF00203  8  {text}",
    }[form]


HEADS = {"asc": "base hex  timestamps absolute\n", "trc": ";$FILEVERSION=1.1\n"}


@pytest.mark.parametrize("form", ["candump", "candump-L", "asc", "trc"])
def test_bus_logs(tmp_path: Path, form: str) -> None:
    stamps = np.round(np.arange(40) * 0.01 + BEFORE, 2)
    data = [struct.pack("<BHBBHB", 0xC5, 6400 + k, 0xFF, 0xFF, 9000, 3) for k in range(40)]
    rows = [line(form, k, time, data[k]) for k, time in enumerate(stamps.tolist())]
    path = tmp_path / "bus.log"
    path.write_text(HEADS.get(form, "") + "\n".join(rows) + "\n")
    found = {one.name: one for one in read_raw(path).channels}["TransOutputShaftSpeed"]
    assert found.time == pytest.approx(stamps)
    assert found.values[0] == 800.0
