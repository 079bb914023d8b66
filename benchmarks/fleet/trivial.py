# SPDX-License-Identifier: MIT
"""A function that takes the place of identification where only the fleet itself is measured."""

from __future__ import annotations

from pathlib import Path

from drivetwin.fleet.rows import Found, Row, RowKind
from drivetwin.fleet.task import ShiftRow, Task

ROWS = 80
"""Rows of a log, as many as an identification leaves."""


def trivial(task: Task) -> Found:
    """As many rows as a log has, from the file's size."""
    size = float(Path(task.path).stat().st_size)
    rows = [Row(RowKind.FIT, f"signal.phase_{k}.rmse", size + k) for k in range(ROWS)]
    return Found(rows, [ShiftRow(True, 0.0, 1.0, "2", "3")])


def make_small_files(folder: Path, count: int) -> None:
    """`count` files that are all different, in folders of 500, and a card."""
    for number in range(count):
        place = folder / f"unit_{number // 500:03d}"
        place.mkdir(parents=True, exist_ok=True)
        (place / f"log_{number:06d}.csv").write_text(f"{number}\n")
    (folder / "card.toml").write_text("gears = 1\n")
