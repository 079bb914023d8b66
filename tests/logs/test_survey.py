# SPDX-License-Identifier: MIT
"""Rate, range and gaps of each column of a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivetwin.channels.mapping import Mapped
from drivetwin.logs.formats.detect import open_recording
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.survey import Survey, survey_recording
from drivetwin.logs.write import write_log


def surveyed(path: Path) -> Survey:
    with open_recording(path) as recording:
        return survey_recording(recording, str(path), None, Mapped({}))


def test_rate_range_and_gaps(tmp_path: Path) -> None:
    time = np.arange(0.0, 3.0, 0.01)
    time = time[(time < 1.0) | (time > 1.5)]
    values = 100.0 + time
    values[10] = np.nan
    path = tmp_path / "log.mf4"
    write_log(path, [RawChannel("n", "rpm", time, values)])
    (column,) = surveyed(path).columns
    assert (column.name, column.group, column.unit) == ("n", "raster 1", "rpm")
    assert column.rate == pytest.approx(100.0)
    assert column.range == (100.0, 100.0 + time[-1])
    assert column.gaps == 2


def test_a_held_signal_shows_its_sender_rate(tmp_path: Path) -> None:
    time = np.arange(0.0, 3.0, 0.001)
    path = tmp_path / "log.csv"
    write_log(path, [RawChannel("te", "Nm", time, np.floor(time / 0.02 + 1e-9))])
    assert surveyed(path).columns[0].rate == pytest.approx(50.0)


def test_a_column_without_numbers_is_told(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("time [s],n [rpm],state\n0,1,eco\n1,2,sport\n")
    found = surveyed(path)
    assert [column.name for column in found.columns] == ["n"]
    assert found.notes[0] == "state: line 2: 'eco' is no number"
