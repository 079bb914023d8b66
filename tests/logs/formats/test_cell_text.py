# SPDX-License-Identifier: MIT
"""Clock times with and without dates."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.logs.formats.cell_text import is_clock, parse_clock_column


@pytest.mark.parametrize(
    "cell",
    ["12:34:56", "0:00:00.001", "12:34:56,789", "2024-05-03T12:34:56.5Z", "03.05.2024 12:34:56",
     "2024/05/03 12:34:56+02:00", "12:34:56:789", "12:34:56.7 PM", "1:02:03 a.m.",
     "03/05/2024 12:34:56", "5/31/2024 1:34:56.789 PM", "31-May-2024 12:34:56.789"],
)  # fmt: skip
def test_what_is_a_clock_time(cell: str) -> None:
    assert is_clock(cell)


@pytest.mark.parametrize(
    "cell",
    ["", "12.5", "hh:mm:ss", "12:34", "Monday 12:34:56", "2024-13-03 12:34:56", "13:00:00 PM",
     "0:00:00 AM"],
)  # fmt: skip
def test_what_is_none(cell: str) -> None:
    assert not is_clock(cell)


def test_midnight_is_passed_with_and_without_date() -> None:
    times = ["23:59:59.990", "00:00:00.010"]
    seconds, count = parse_clock_column(times, None)
    assert count == 2
    assert seconds == pytest.approx([0.0, 0.02], abs=1e-9)
    seconds, _ = parse_clock_column(times, ["31.12.2023", "01.01.2024"])
    assert seconds == pytest.approx([0.0, 0.02], abs=1e-9)


def test_halves_of_a_day_begin_at_twelve() -> None:
    cells = ["11:59:59.5 AM", "12:00:00.0 PM", "12:59:59.5 PM", "1:00:00.0 PM", "11:59:59 PM"]
    seconds, count = parse_clock_column([*cells, "12:00:00\u202fAM"], None)
    assert count == 6
    assert seconds.tolist() == [0.0, 0.5, 3600.0, 3600.5, 43199.5, 43200.5]


@pytest.mark.parametrize("day", ["05/06/2024", "31-Mai-2024"])
def test_a_day_that_only_may_be_compared_counts_where_it_is_the_same(day: str) -> None:
    seconds, count = parse_clock_column([f"{day} 12:00:00.25", f"{day} 12:00:00.50"], None)
    assert (seconds.tolist(), count) == ([0.0, 0.25], 2)
    cells = [f"{day} 23:59:59.75", "06/06/2024 00:00:00.25"]
    assert parse_clock_column(cells, None)[1] == 0
    assert parse_clock_column(["23:59:59", "00:00:00"], [day, ""])[1] == 0


def test_reading_stops_at_what_is_no_time() -> None:
    assert parse_clock_column(["12:00:00", "noon", "12:00:02"], None)[1] == 1


@given(st.lists(st.integers(0, 86_399_999), min_size=1, max_size=20).map(sorted))
def test_milliseconds_come_back(stamps: list[int]) -> None:
    cells = [
        f"2024-02-28T{ms // 3_600_000:02}:{ms // 60_000 % 60:02}:"
        f"{ms // 1000 % 60:02}.{ms % 1000:03}"
        for ms in stamps
    ]
    seconds, count = parse_clock_column(cells, None)
    assert count == len(stamps)
    assert np.abs(1e3 * seconds - (np.array(stamps) - stamps[0])).max() < 1e-6
