# SPDX-License-Identifier: MIT
"""Clock times with and without dates, as stamps of a table."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import DrivetwinError, TimeError
from tests.logs.formats.text_logs import read_csv
from tests.support.arrays import FloatArray


def read(cells: list[str], head: str = "Time") -> FloatArray:
    """Stamps [s] from the first, of one or two columns of clock and date."""
    rows = (f"{cell},{k}" for k, cell in enumerate(cells))
    (channel,) = read_csv("\n".join([f"{head},x [Nm]", *rows]).encode()).channels
    return np.asarray(channel.time - channel.time[0], np.float64)


@pytest.mark.parametrize("cell", ["12:34", "Monday 12:34:56", "2024-13-03 12:34:56", "13:00:00 PM",
                                  "0:00:00 AM", "hh:mm:ss"])  # fmt: skip
def test_what_is_no_clock_time(cell: str) -> None:
    with pytest.raises(DrivetwinError):
        read([cell, cell])


def test_midnight_is_passed_with_and_without_date() -> None:
    assert read(["23:59:59.990", "00:00:00.010"]) == pytest.approx([0.0, 0.02], abs=1e-9)
    dated = ["31.12.2023,23:59:59.990", "01.01.2024,00:00:00.010"]
    assert read(dated, "Date,Time") == pytest.approx([0.0, 0.02], abs=1e-9)


def test_halves_of_a_day_begin_at_twelve() -> None:
    cells = ["11:59:59.5 AM", "12:00:00.0 PM", "12:59:59.5 PM", "1:00:00.0 PM", "11:59:59 PM"]
    found = read([*cells, "12:00:00\u202fAM"])
    assert found.tolist() == [0.0, 0.5, 3600.0, 3600.5, 43199.5, 43200.5]


@pytest.mark.parametrize("day", ["05/06/2024", "31-Mai-2024"])
def test_a_day_that_only_may_be_compared_counts_where_it_is_the_same(day: str) -> None:
    assert read([f"{day} 12:00:00.25", f"{day} 12:00:00.50"]).tolist() == [0.0, 0.25]
    with pytest.raises(TimeError):
        read([f"{day} 23:59:59.75", "06/06/2024 00:00:00.25"])


@given(st.lists(st.integers(0, 86_399_999), min_size=1, max_size=20).map(sorted))
def test_milliseconds_come_back(stamps: list[int]) -> None:
    cells = [
        f"2024-02-28T{ms // 3_600_000:02}:{ms // 60_000 % 60:02}:"
        f"{ms // 1000 % 60:02}.{ms % 1000:03}"
        for ms in stamps
    ]
    assert np.abs(1e3 * read(cells) - (np.array(stamps) - stamps[0])).max() < 1e-6
