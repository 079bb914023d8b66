# SPDX-License-Identifier: MIT
"""The two files of expected values: `expected.csv` and `events.csv`."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Column = tuple[str, str]
"""Kind of output and name of its node or element, as in `drivetwin.simulation.network`."""


class Change(NamedTuple):
    """A friction element locks, breaks away or reverses."""

    time: float
    element: str
    kind: str


class Table(NamedTuple):
    """Instants (n,) [s] and columns (n,), SI."""

    time: NDArray[np.float64]
    columns: Mapping[Column, NDArray[np.float64]]


class Solution(NamedTuple):
    """What a `solve.py` returns."""

    table: Table
    changes: tuple[Change, ...]


def write(folder: Path, solution: Solution) -> None:
    """Write both files; 12 digits hold what the solver can tell."""
    table = solution.table
    values = np.column_stack([table.time, *table.columns.values()])
    header = ["time", *(f"{kind} {name}" for kind, name in table.columns)]
    _write_rows(folder / "expected.csv", header, [[f"{v:.12g}" for v in row] for row in values])
    changes = [[f"{c.time:.12g}", c.element, c.kind] for c in solution.changes]
    _write_rows(folder / "events.csv", ["time", "element", "kind"], changes)


def read(folder: Path) -> Solution:
    """Read both files."""
    header, *rows = _read_rows(folder / "expected.csv")
    values = np.array(rows, dtype=np.float64)
    kinds = [tuple(name.split(" ", 1)) for name in header[1:]]
    columns = {(kind, name): values[:, i + 1] for i, (kind, name) in enumerate(kinds)}
    _, *events = _read_rows(folder / "events.csv")
    changes = tuple(Change(float(time), element, kind) for time, element, kind in events)
    return Solution(Table(values[:, 0], columns), changes)


def _write_rows(path: Path, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([header, *rows])


def _read_rows(path: Path) -> list[list[str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))
