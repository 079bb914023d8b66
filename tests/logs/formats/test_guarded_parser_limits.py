# SPDX-License-Identifier: MIT
"""Limits by the size of a file."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.logs.formats.guarded import BASE_MEMORY, BASE_TIME, compute_parser_limits


def test_a_long_log_gets_more_time_within_bounds_and_more_memory(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    for size, limit in ((1000, BASE_TIME + 0.002), (160_000_000, BASE_TIME + 320.0), (10**9, 600)):
        with log.open("wb") as file:
            file.truncate(size)
        limits = compute_parser_limits(log)
        assert limits.seconds == pytest.approx(limit)
        assert limits.memory == BASE_MEMORY + 16 * size


def test_an_absent_file_gets_what_a_small_one_gets(tmp_path: Path) -> None:
    assert compute_parser_limits(tmp_path / "absent").memory == BASE_MEMORY
