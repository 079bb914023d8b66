# SPDX-License-Identifier: MIT
"""Conventions of loggers whose tables do not state names or units beside each other.

LabVIEW counts `X_Value` in seconds. VCDS splits a name over two lines and writes `STAMP` below the
name of a time in seconds. Racelogic VBOX lists the units of its last columns in a section, and
writes time as a clock without colons.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.channels.names import is_time_name
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.errors import TimeError, Where
from drivetwin.logs.formats.table_head import TableHead

_LABVIEW = "LabVIEW Measurement"
_STAMP = "STAMP"
_COLUMN_NAMES, _CHANNEL_UNITS = "[column names]", "[channel units]"


@dataclass(frozen=True)
class Columns:
    """Names and units of the columns; whether time is a clock without colons, as 101112.05."""

    names: Sequence[str]
    units: Sequence[str | None]
    is_packed_clock: bool = False


def apply_conventions(head: TableHead, columns: Columns) -> Columns:
    """Return the columns as the logger that wrote the head means them."""
    above = [line.text.strip() for line in head.above]
    below = next((line.cells for line in head.below if _STAMP in line.cells), None)
    if above and above[0].startswith(_LABVIEW):
        return _set_time_unit(columns, range(len(columns.names)))
    if below is not None:
        return _apply_vcds(head, columns, below)
    if _COLUMN_NAMES in map(str.casefold, above):
        return _apply_vbox(above, columns)
    return columns


def _set_time_unit(columns: Columns, where: Sequence[int]) -> Columns:
    units = [
        unit or ("s" if index in where and is_time_name(name) else None)
        for index, (name, unit) in enumerate(zip(columns.names, columns.units, strict=True))
    ]
    return Columns(columns.names, units)


def _apply_vcds(head: TableHead, columns: Columns, below: Sequence[str]) -> Columns:
    stamped = [index for index, cell in enumerate(below) if cell == _STAMP]
    upper = head.above[-1].cells if head.above and not head.above[-1].cells[0] else ()
    names = [
        name if is_time_name(name) or index >= len(upper) else f"{upper[index]} {name}".strip()
        for index, name in enumerate(columns.names)
    ]
    units = [None if unit == _STAMP else unit for unit in columns.units]
    return _set_time_unit(Columns(names, units), stamped)


def _apply_vbox(above: Sequence[str], columns: Columns) -> Columns:
    """Give the last columns the units of the section; others have those of the format."""
    lines = list(above)
    start = next((i for i, line in enumerate(lines) if line.casefold() == _CHANNEL_UNITS), None)
    stated: list[str] = []
    for line in lines[start + 1 :] if start is not None else ():
        if line.startswith("["):
            break
        stated.append(line)
    first = len(columns.names) - len(stated)
    units = [
        unit or (stated[index - first] if index >= first >= 0 else None)
        for index, unit in enumerate(columns.units)
    ]
    return Columns(columns.names, units, is_packed_clock=True)


def unpack_clock(numbers: FloatArray, where: Where) -> FloatArray:
    """Return the seconds (n,) since midnight of clock times without colons, as 101112.05.

    Raises TimeError for a number that is no clock time.
    """
    hours, rest = np.divmod(numbers, 1e4)
    minutes, seconds = np.divmod(rest, 100.0)
    wrong = ~((hours < 24.0) & (minutes < 60.0) & (seconds < 60.0) & (numbers >= 0.0))
    if wrong.any():
        what = f"{numbers[int(wrong.argmax())]:.10g} is no clock time of the form hhmmss.ss"
        raise TimeError(what, "export the log as CSV with a time in seconds", where)
    return np.asarray(np.round(3600.0 * hours + 60.0 * minutes + seconds, 6))
