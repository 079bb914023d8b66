# SPDX-License-Identifier: MIT
"""What `inspect` tells of each column."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivetwin.logs.formats.detect import open_recording
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.summary import Summary, summarise_recording
from drivetwin.logs.write import write_log


def summary(path: Path) -> Summary:
    with open_recording(path) as recording:
        return summarise_recording(recording)


def test_rate_range_span_and_gaps(tmp_path: Path) -> None:
    time = np.arange(0.0, 3.0, 0.01)
    time = time[(time < 1.0) | (time > 1.5)]
    values = 100.0 + time
    values[10] = np.nan
    path = tmp_path / "log.mf4"
    write_log(path, [RawChannel("n", "rpm", time, values)])
    (column,) = summary(path).columns
    assert str(column.column) == "n (raster 1)"
    assert column.samples == time.size
    assert column.rate == pytest.approx(100.0)
    assert column.range == (100.0, 100.0 + time[-1])
    assert column.span == (0.0, time[-1])
    assert column.gaps == 2


def test_a_held_signal_shows_its_sender_rate(tmp_path: Path) -> None:
    time = np.arange(0.0, 3.0, 0.001)
    path = tmp_path / "log.csv"
    write_log(path, [RawChannel("te", "Nm", time, np.floor(time / 0.02 + 1e-9))])
    assert summary(path).columns[0].rate == pytest.approx(50.0)


def test_a_column_without_numbers_is_told(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("time [s],n [rpm],state\n0,1,on\n1,2,off\n")
    faults = {one.column.name: one.fault for one in summary(path).columns}
    assert faults == {"n": None, "state": "line 2: 'on' is no number"}
