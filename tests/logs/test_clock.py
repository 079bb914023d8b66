# SPDX-License-Identifier: MIT
"""Clock times with and without dates."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.logs.clock import clock_seconds, is_clock


@pytest.mark.parametrize(
    "cell",
    ["12:34:56", "0:00:00.001", "12:34:56,789", "2024-05-03T12:34:56.5Z", "03.05.2024 12:34:56",
     "2024/05/03 12:34:56+02:00", "12:34:56:789"],
)  # fmt: skip
def test_what_is_a_clock_time(cell: str) -> None:
    assert is_clock(cell)


@pytest.mark.parametrize(
    "cell", ["", "12.5", "hh:mm:ss", "12:34", "03/05/2024 12:34:56", "2024-13-03 12:34:56"]
)
def test_what_is_none(cell: str) -> None:
    assert not is_clock(cell)


def test_midnight_is_passed_with_and_without_date() -> None:
    times = ["23:59:59.990", "00:00:00.010"]
    seconds, count = clock_seconds(times, None)
    assert count == 2
    assert seconds == pytest.approx([0.0, 0.02], abs=1e-9)
    seconds, _ = clock_seconds(times, ["31.12.2023", "01.01.2024"])
    assert seconds == pytest.approx([0.0, 0.02], abs=1e-9)


def test_reading_stops_at_what_is_no_time() -> None:
    assert clock_seconds(["12:00:00", "noon", "12:00:02"], None)[1] == 1


@given(st.lists(st.integers(0, 86_399_999), min_size=1, max_size=20).map(sorted))
def test_milliseconds_come_back(stamps: list[int]) -> None:
    cells = [
        f"2024-02-28T{ms // 3_600_000:02}:{ms // 60_000 % 60:02}:"
        f"{ms // 1000 % 60:02}.{ms % 1000:03}"
        for ms in stamps
    ]
    seconds, count = clock_seconds(cells, None)
    assert count == len(stamps)
    assert np.abs(1e3 * seconds - (np.array(stamps) - stamps[0])).max() < 1e-6
