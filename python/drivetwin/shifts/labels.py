# SPDX-License-Identifier: MIT
"""What the shifts of a log are called, so that each can be told from the others."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin.shifts.shift import Shift


def shift_labels(shifts: Sequence[Shift], to: str = "→") -> list[str]:
    """The shifts of a log by their gears, `2→3`; of those between the same gears each with the
    time of its lock-up, `2→3 at 3.34 s`.
    """
    names = [f"{one.start_gear}{to}{one.end_gear}" for one in shifts]
    return [
        f"{name} at {one.lockup_time:.2f} s" if names.count(name) > 1 else name
        for name, one in zip(names, shifts, strict=True)
    ]
