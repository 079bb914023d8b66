# SPDX-License-Identifier: MIT
"""Replacements of the identification for measurements of the fleet itself."""

from __future__ import annotations

import hashlib
import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path
from time import process_time

from drivetwin.fleet.identify import identify_log
from drivetwin.fleet.task import Found, Row, RowKind, Task, TaskSpec
from tests.support.synthetic_fleet import make_fleet

CLOCK = "processor_time"
"""Name of the row with the processor time [s] that identifying a log took."""
_MODEL = ".model.csv"
"""The one real log; a file whose name begins with a dot is no log of the fleet."""


def identify_timed(task: Task) -> Found:
    """Identify a log, with a row for the processor time that it took."""
    start = process_time()
    found = identify_log(task)
    row = Row(RowKind.QUALITY, CLOCK, process_time() - start, shift=0)
    return Found([*found.rows, row], found.shifts)


def copy_rows(task: Task) -> Found:
    """Return the rows of a real log, identified once in each worker; numbers differ by file."""
    number = int(Path(task.path).read_text())
    model = _identify_model(task.recipe)
    rows = [
        row if row.value is None else replace(row, value=row.value * (1.0 + 1e-6 * number))
        for row in model.rows
    ]
    return Found(rows, model.shifts)


@cache
def _identify_model(recipe: TaskSpec) -> Found:
    path = Path(recipe.vehicle).with_name(_MODEL)
    content = hashlib.sha256(path.read_bytes()).hexdigest()
    return identify_log(Task("", str(path), content, recipe, ""))


def make_healthy_logs(folder: Path, count: int) -> None:
    """Write `count` synthetic logs without the damaged ones, with rules and card."""
    for made in make_fleet(folder, count):
        if made.damage:
            (folder / made.path).unlink()


def make_small_files(folder: Path, count: int) -> None:
    """Write `count` different files in folders of 500, with the rules and card of the model."""
    make_fleet(folder, 1)
    shutil.move(next(folder.glob("unit_*/*.csv")), folder / _MODEL)
    for number in range(count):
        place = folder / f"unit_{number // 500:03d}"
        place.mkdir(exist_ok=True)
        (place / f"log_{number:06d}_at_{number % 200}_Mm.csv").write_text(f"{number}\n")
