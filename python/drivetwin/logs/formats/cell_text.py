# SPDX-License-Identifier: MIT
"""Meaning of the text of a table's cells, numbers and times, without guessing."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from drivetwin.channels.shiftlog import FloatArray
from drivetwin.channels.units import get_time_factor, is_time_unit
from drivetwin.errors import FileFormatError, TimeError, Where
from drivetwin.logs.quality.clock_drift import is_clock, parse_clock_column

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_COMMA_NUMBER = re.compile(r"[+-]?(\d+,\d*|,\d+)([eE][+-]?\d+)?", re.ASCII)

_GROUPED = re.compile(r"[+-]?\d{1,3}([ .,'’\u00a0\u202f]\d{3})+([.,]\d*)?", re.ASCII)
"""A number with signs between its thousands, in the manner of any country."""

_NOT_A_NUMBER = re.compile(
    r"[+-]?(nan|nan\((ind|snan)\)|inf|infinity|1\.#(ind|qnan|snan|inf)0*)|#?n/a|n\.a\.|na|<na>|nat|"
    r"\(?null\)?|none|nil|missing|invalid|#nv|#n/v|#num!|#div/0!|#zahl!|#value!|#wert!",
    re.IGNORECASE,
)
"""Words for no number: of C libraries, of databases, of Excel in English and German."""

_ABSENT = re.compile(r"[-\u2010-\u2015\u2212]{1,4}|\.{1,3}|\*{1,4}|\?{1,3}")
"""Signs that stand for an empty cell."""


class Meaning(Enum):
    """Meaning of a cell that holds no number."""

    ABSENT = "no sample"
    NO_NUMBER = "a sample without a number"
    TEXT = "a text"


def classify_text(cell: str) -> Meaning:
    """Return the meaning of a cell that holds no number."""
    if not cell or _ABSENT.fullmatch(cell):
        return Meaning.ABSENT
    return Meaning.NO_NUMBER if _NOT_A_NUMBER.fullmatch(cell) else Meaning.TEXT


def is_number(cell: str) -> bool:
    """Return True if a cell is a number with decimal point or comma."""
    text = cell.strip()
    return (_NUMBER.fullmatch(text) or _COMMA_NUMBER.fullmatch(text)) is not None


def describe_text(cell: str, line: int) -> str:
    """Describe a cell that should hold a number."""
    fault = f"line {line}: {cell[:40]!r} is no number"
    if _GROUPED.fullmatch(cell):
        fault += " that can be read: export without signs between thousands"
    return fault


Written = tuple[bytes | None, bytes | None, bytes | None, bool]
"""The first number of a column with point, with comma and without either; and whether a comma
cannot stand between thousands."""


def check_decimal_signs(columns: Sequence[Written], file: str) -> None:
    """Refuse numbers whose decimal sign is open.

    Raises FileFormatError where both point and comma occur: then one of them groups thousands; and
    where each comma stands as between thousands, in the file or in a column that holds whole
    numbers without.
    """
    comma = next((comma for _, comma, _, _ in columns if comma is not None), None)
    if comma is None:
        return
    example = comma.decode()
    point = next((point for point, _, _, _ in columns if point is not None), None)
    grouped = next(
        ((comma, whole) for _, comma, whole, clear in columns if comma and whole and not clear),
        None,
    )
    if point is not None:
        fault = f"numbers with point ({point.decode()!r}) and with comma ({example!r})"
    elif not any(clear for _, _, _, clear in columns):
        fault = f"the comma in {example!r} and all others may separate decimals or thousands"
    elif grouped is not None:
        one, other = (text.decode() for text in grouped)
        fault = f"a column with {one!r} and {other!r}: the comma may group thousands"
    else:
        return
    remedy = "export with one decimal sign and no sign between thousands"
    raise FileFormatError(fault, remedy, Where(file=file))


@dataclass(frozen=True, eq=False)
class NumberTexts:
    """Numbers (n,) of texts, NaN where a text is no number; `note` describes the choice."""

    values: FloatArray
    note: str


def parse_numbers(texts: Iterable[str]) -> FloatArray:
    """Return the numbers (n,) of texts; NaN for texts that are no numbers.

    A comma may be a decimal sign or stand between thousands: such a text is no number.
    """
    stripped = [text.strip() for text in texts]
    known = [is_number(text) and "," not in text for text in stripped]
    return np.array([float(x) if ok else np.nan for x, ok in zip(stripped, known, strict=True)])


def select_numbers(texts: Sequence[str], codes: FloatArray) -> NumberTexts | None:
    """Return the numbers that stand for `codes` (n,) by their texts (n,).

    Returns None where the codes are to be taken: no text is a number, or those that are state the
    code itself and others name codes, such as `N` beside `1` and `2`.
    """
    values = parse_numbers(texts)
    is_value = np.isfinite(values)
    same = np.array_equal(values[is_value], codes[is_value])
    if not is_value.any() or (same and not is_value.all()):
        return None
    others = [text.strip() for text, number in zip(texts, is_value, strict=True) if not number]
    named = ", ".join(repr(text) for text in dict.fromkeys(others) if text)
    note = "texts that are numbers taken as values" + (f", not {named}" if named else "")
    return NumberTexts(values, "" if same else note)


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
