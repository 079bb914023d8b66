# SPDX-License-Identifier: MIT
"""Time stamps written as a clock: `12:34:56.789`, with a date beside it or before it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import date

import numpy as np

from drivetwin.logs.shiftlog import FloatArray

_DAY = 86400.0
_CLOCK = re.compile(r"(\d{1,3}):(\d{2}):(\d{2})(?:[.,:](\d{1,9}))?", re.ASCII)
_DATES = (
    re.compile(r"(?P<y>\d{4})[-/.](?P<m>\d{1,2})[-/.](?P<d>\d{1,2})", re.ASCII),
    re.compile(r"(?P<d>\d{1,2})\.(?P<m>\d{1,2})\.(?P<y>\d{4})", re.ASCII),
)
"""Year first, or day.month.year; with slashes day and month cannot be told apart."""

_ZONE = re.compile(r"(Z|[+-]\d{2}:?\d{2})$")


def is_clock(cell: str) -> bool:
    """Tell whether a cell is a clock time, with or without a date before it."""
    return _parse(cell, "") is not None


def clock_seconds(cells: Sequence[str], dates: Sequence[str] | None) -> tuple[FloatArray, int]:
    """Return seconds since the first stamp (n,) and the number of stamps that are readable.

    Reading stops at the first cell that is no clock time; `dates` (n,) hold the day where it stands
    in a column of its own. Without any date a step back by more than half a day is midnight.
    """
    seconds, days = np.zeros(len(cells)), np.zeros(len(cells))
    dated = False
    for row, cell in enumerate(cells):
        stamp = _parse(cell, "" if dates is None else dates[row])
        if stamp is None:
            return seconds, row
        day, seconds[row] = stamp
        days[row] = day or 0
        dated |= day is not None
    if not dated:
        days = np.concatenate(([0.0], np.cumsum(np.diff(seconds) < -0.5 * _DAY)))[: len(cells)]
    return _DAY * (days - days[:1]) + (seconds - seconds[:1]), len(cells)


def _parse(cell: str, day: str) -> tuple[int | None, float] | None:
    """Day number, where a date is given, and seconds since midnight."""
    before, _, clock = _ZONE.sub("", cell.strip()).replace("T", " ").rpartition(" ")
    match = _CLOCK.fullmatch(clock)
    if match is None:
        return None
    hours, minutes, seconds, fraction = match.groups()
    since = 3600.0 * int(hours) + 60.0 * int(minutes) + int(seconds)
    since += float(f"0.{fraction}") if fraction else 0.0
    written = (before or day).strip()
    if not written:
        return None, since
    days = _days(written)
    return None if days is None else (days, since)


def _days(text: str) -> int | None:
    for pattern in _DATES:
        if match := pattern.fullmatch(text):
            try:
                return date(int(match["y"]), int(match["m"]), int(match["d"])).toordinal()
            except ValueError:
                return None
    return None
