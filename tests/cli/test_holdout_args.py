# SPDX-License-Identifier: MIT
"""What `--hold-out` may name."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.cli.holdout_args import parse_holdouts
from drivetwin.errors import InputError
from drivetwin.shifts.detect import FoundShifts
from tests.estimation.multi_log.fixtures import pair

LOGS = (Path("runs/a.csv"), Path("runs/b.mf4"))


def _held(*wanted: str, logs: tuple[Path, ...] = LOGS) -> list[set[int]]:
    two = FoundShifts(2 * pair()[0].shifts.shifts, ())
    return [set(one) for one in parse_holdouts(wanted, logs, [two] * len(logs))]


@pytest.mark.parametrize("name", ["b", "b.mf4", "runs/b.mf4"])
def test_a_log_holds_out_all_its_shifts(name: str) -> None:
    assert _held(name) == [set(), {1, 2}]


def test_a_shift_of_a_log() -> None:
    assert _held("a.csv:2", "b:1") == [{2}, {1}]


def test_of_one_log_the_number_is_enough() -> None:
    assert _held("2", logs=LOGS[:1]) == [{2}]


@pytest.mark.parametrize("name", ["1", "c.csv", "a:x", "a:", ":1", "c:1", "", "a:" + 5000 * "9"])
def test_anything_else_is_refused_by_name(name: str) -> None:
    with pytest.raises(InputError, match="names no shift or log"):
        _held(name)
