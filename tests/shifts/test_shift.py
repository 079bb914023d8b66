# SPDX-License-Identifier: MIT
"""What shifts are called: each one so that it can be told from the others."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.shifts.shift import make_shift_labels
from tests.report.sample import identification


def test_shifts_between_the_same_gears_are_told_apart_by_their_lock_up() -> None:
    (shift,) = identification().shifts
    later, other = replace(shift, lockup_time=62.5), replace(shift, end_gear="4")
    assert make_shift_labels([shift, other]) == ["2→3", "2→4"]
    first = f"2→3 at {shift.lockup_time:.2f} s"
    assert make_shift_labels([shift, other, later]) == [first, "2→4", "2→3 at 62.50 s"]
