# SPDX-License-Identifier: MIT
"""Time stamps written as a clock: `12:34:56.789` or `1:34:56 PM`, with an optional date."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import date

import numpy as np

from drivetwin.channels.shiftlog import FloatArray

_DAY = 86400.0
_STAMP = re.compile(
    r"(?:(?P<date>\S.*?)(?:T|\s+))?(?P<h>[0-9]{1,3}):(?P<m>[0-9]{2}):(?P<s>[0-9]{2})"
    r"(?:[.,:](?P<fraction>[0-9]{1,9}))?(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?"
)
_DATES = (
    re.compile(r"(?P<y>\d{4})[-/.](?P<m>\d{1,2})[-/.](?P<d>\d{1,2})", re.ASCII),
    re.compile(r"(?P<d>\d{1,2})\.(?P<m>\d{1,2})\.(?P<y>\d{4})", re.ASCII),
)
"""Year first, or day.month.year."""

_ONE_DAY = re.compile(r"[0-9]{1,2}/[0-9]{1,2}/[0-9]{2,4}|[0-9]{1,2}-[^\W\d_]{3,4}\.?-[0-9]{4}")
"""Dates that are accepted only if all rows have the same one: with slashes the order of day and
month is ambiguous, and names of months depend on the language."""

_ZONE = re.compile(r"(Z|[+-]\d{2}:?\d{2})$")


def is_clock(cell: str) -> bool:
    """Return True if a cell is a clock time, with or without a date before it."""
    return _parse_clock_cell(cell, "") is not None


def parse_clock_column(cells: Sequence[str], dates: Sequence[str] | None) -> tuple[FloatArray, int]:
    """Return seconds since the first stamp (n,) and the number of stamps that are readable.

    Reading stops at the first cell that is no clock time; `dates` (n,) hold the day where it stands
    in a column of its own. Without any date a step back by more than half a day is midnight.
    """
    seconds = np.zeros(len(cells))
    written: list[str] = []
    for row, cell in enumerate(cells):
        stamp = _parse_clock_cell(cell, "" if dates is None else dates[row])
        if stamp is None:
            return seconds, row
        seconds[row] = stamp[1]
        written.append(stamp[0])
    if not any(written):
        days = np.concatenate(([0.0], np.cumsum(np.diff(seconds) < -0.5 * _DAY)))[: len(cells)]
    else:
        numbered = {text: _parse_days(text) for text in dict.fromkeys(written)}
        numbers = [0 if len(numbered) == 1 else numbered[text] for text in written]
        if None in numbers:
            return seconds, numbers.index(None)
        days = np.array(numbers, np.float64)
    return _DAY * (days - days[:1]) + (seconds - seconds[:1]), len(cells)


def _parse_clock_cell(cell: str, day: str) -> tuple[str, float] | None:
    """The date as written, blank without any, and seconds since midnight."""
    match = _STAMP.fullmatch(_ZONE.sub("", cell.strip()))
    if match is None:
        return None
    hours = int(match["h"])
    if match["half"]:  # 12 AM is midnight, 12 PM noon
        if not 1 <= hours <= 12:
            return None
        hours = hours % 12 + (12 if match["half"] in "Pp" else 0)
    since = 3600.0 * hours + 60.0 * int(match["m"]) + int(match["s"])
    since += float(f"0.{match['fraction']}") if match["fraction"] else 0.0
    written = (match["date"] or day).strip()
    if written and _parse_days(written) is None and not _ONE_DAY.fullmatch(written):
        return None
    return written, since


def _parse_days(text: str) -> int | None:
    for pattern in _DATES:
        if match := pattern.fullmatch(text):
            try:
                return date(int(match["y"]), int(match["m"]), int(match["d"])).toordinal()
            except ValueError:
                return None
    return None
