# SPDX-License-Identifier: MIT
"""Time stamps written as a text: a clock time, or a duration such as `0.001 sec`."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from drivetwin.channels.shiftlog import FloatArray
from drivetwin.channels.units import get_time_factor, is_time_unit
from drivetwin.errors import TimeError, Where
from drivetwin.logs.quality.clock_drift import is_clock, parse_clock_column

_DECIMAL = r"\d+(?:[.,]\d*)?|[.,]\d+"
_WITH_UNIT = re.compile(rf"([+-]?(?:{_DECIMAL})(?:[eE][+-]?\d+)?)\s*([^\W\d_]+)", re.ASCII)
"""`0.001 sec` of MATLAB, `1.5ms`."""

_CLOCK = r"(?P<h>\d+):(?P<m>\d\d):(?P<s>\d\d(?:[.,]\d*)?)"
_DAYS = re.compile(rf"(?:(?P<d>[+-]?\d+) days?,? )?(?P<sign>[+-]?){_CLOCK}", re.ASCII)
"""`0 days 00:00:00.001` of pandas, `1 day, 0:00:00.5` of Python, `-00:00:00.5`."""

_MINUTES = re.compile(r"(?P<sign>[+-]?)(?P<m>\d+):(?P<s>\d\d[.,]\d+)", re.ASCII)
"""`01:02.345`: the decimals belong to seconds. `01:02` may be hours and minutes."""

_ISO = re.compile(
    rf"(?P<sign>[+-]?)P(?:(?P<d>[+-]?\d+)D)?(?:T(?:(?P<h>{_DECIMAL})H)?(?:(?P<m>{_DECIMAL})M)?"
    rf"(?:(?P<s>{_DECIMAL})S)?)?",
    re.ASCII,
)
"""`PT0.001S` of ISO 8601."""

_DAY = 86400.0
_SECONDS = {"h": 3600.0, "m": 60.0, "s": 1.0}


def parse_duration(cell: str) -> float | None:
    """Return the seconds of a duration with its unit, or None."""
    text = cell.strip()
    if match := _WITH_UNIT.fullmatch(text):
        if not is_time_unit(match[2]):
            return None
        return get_time_factor(match[2], Where()) * float(match[1].replace(",", "."))
    for pattern in (_DAYS, _MINUTES, _ISO):
        match = pattern.fullmatch(text)
        if match is None or (pattern is _ISO and not any(map(str.isdigit, text))):
            continue
        parts = {name: part.replace(",", ".") for name, part in match.groupdict("").items()}
        size = sum(float(parts.get(name) or 0.0) * factor for name, factor in _SECONDS.items())
        return float(parts.get("d") or 0.0) * _DAY + (-size if match["sign"] == "-" else size)
    return None


def is_time_text(cell: str) -> bool:
    """Return True if a cell is a clock time or a duration with its unit."""
    return is_clock(cell) or parse_duration(cell) is not None


def parse_time_texts(
    cells: Sequence[str], dates: Sequence[str] | None, lines: Sequence[int], where: Where
) -> FloatArray:
    """Convert a column of texts to seconds (n,), clock times from the first.

    Raises TimeError for the first cell of another form.
    """
    if not is_clock(cells[0]):
        return _parse_durations(cells, lines, where)
    seconds, count = parse_clock_column(cells, dates)
    if count < seconds.size:
        remedy = "export time as seconds since the start of the recording"
        cell, word = cells[count], "clock time"
        if dates is not None and is_clock(cell):  # the day beside it is at fault
            cell, word = dates[count], "date that can be read"
            remedy = f"write it as 2024-05-31 or 31.05.2024, or {remedy}"
        what = f"no time stamp: line {lines[count]}: {cell.strip()[:40]!r} is no {word}"
        raise TimeError(what, remedy, where)
    return seconds


def _parse_durations(cells: Sequence[str], lines: Sequence[int], where: Where) -> FloatArray:
    seconds = np.empty(len(cells))
    for row, cell in enumerate(cells):
        found = parse_duration(cell)
        if found is None:
            what = f"no time stamp: line {lines[row]}: {cell.strip()[:40]!r} is no duration"
            raise TimeError(what, "export time as seconds since the start of the recording", where)
        seconds[row] = found
    return seconds
