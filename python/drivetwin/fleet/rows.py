# SPDX-License-Identifier: MIT
"""The rows that a log leaves: one schema for parameters, friction, fits, quality and warnings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from enum import StrEnum
from functools import cache
from typing import Any

from drivetwin.estimation.result.estimate import Estimate
from drivetwin.fleet.task import ShiftRow

MU = "mu."
"""Id of the friction coefficient at the recipe's reference slip, before the element's name."""


class RowKind(StrEnum):
    """Kind of a row, which also determines the meaning of its `name`."""

    PARAMETER = "parameter"
    """Parameter id; `mu.<element>` is μ at slip `at`."""
    FRICTION = "friction"
    """Element; μ at slip `at`."""
    FIT = "fit"
    """`<signal>.<phase>.rmse` or `.fit_percent` of simulation over measurement."""
    QUALITY = "quality"
    """Quality figure of shift number `shift`."""
    FIELD = "field"
    """Mean of a channel that the rules made a field."""
    WARNING = "warning"
    """Code of a finding, empty for other remarks; the text is the `reason`."""


@dataclass(frozen=True)
class Row:
    """One number of a log, SI; `at` is a slip [rad/s].

    `free_value`, `free_std` are the estimate from the log alone if the value also depends on a
    design value of the card.
    """

    kind: RowKind
    name: str
    value: float | None = None
    std_noise: float | None = None
    std_total: float | None = None
    ci95_lo: float | None = None
    ci95_hi: float | None = None
    si_unit: str = ""
    verdict: str = ""
    method: str = ""
    reason: str = ""
    shift: int | None = None
    at: float | None = None
    free_value: float | None = None
    free_std: float | None = None


def make_estimate_row(one: Estimate) -> Row:
    """Return the row of an estimate."""
    low, high = one.ci95_total or (None, None)
    return Row(
        RowKind.PARAMETER, one.id, one.value, one.std_noise, one.std_total, low, high,
        one.unit, one.verdict.value, one.method, one.reason,
    )  # fmt: skip


ROW_COLUMNS = ("log", *(field.name for field in fields(Row)))
"""Columns of a part: the key of the log's row in the index, then those of a Row."""


@dataclass(frozen=True)
class Found:
    """Result of identifying a log: its rows and its shifts."""

    rows: Sequence[Row]
    shifts: Sequence[ShiftRow]


@cache
def make_schema() -> Any:
    """Arrow schema of all parts; `log` is the key of the log's row in the index."""
    import pyarrow as pa

    texts = ("si_unit", "verdict", "method", "reason")
    numbers = ("value", "std_noise", "std_total", "ci95_lo", "ci95_hi")
    return pa.schema(
        [
            ("log", pa.string()),
            ("kind", pa.string()),
            ("name", pa.string()),
            *((name, pa.float64()) for name in numbers),
            *((name, pa.string()) for name in texts),
            ("shift", pa.int16()),
            ("at", pa.float64()),
            ("free_value", pa.float64()),
            ("free_std", pa.float64()),
        ]
    )


def make_arrow_table(log: str, rows: Sequence[Row]) -> Any:
    """Arrow table of a log's rows, in their order."""
    import pyarrow as pa

    columns = {name: [getattr(row, name) for row in rows] for name in make_schema().names[1:]}
    return pa.table({"log": [log] * len(rows), **columns}, schema=make_schema())
