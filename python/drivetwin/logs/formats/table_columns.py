# SPDX-License-Identifier: MIT
"""Names, units and time columns of a text table, from its head.

Tools that export channels of several rates into one table write `Time_EngTrq, EngTrq` (bench
recorders), `EngTrq Time, EngTrq ValueY` (trends of process control) or `EngTrq [s], EngTrq [Nm]`.
The partner is found by the name alone: without the word for time it is the name of another column.
No order of the columns is assumed.

Loggers whose tables do not state names or units beside each other: LabVIEW counts `X_Value` in
seconds. VCDS splits a name over two lines and writes `STAMP` below the name of a time in seconds.
Racelogic VBOX lists the units of its last columns in a section, and writes time as a clock without
colons.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from drivetwin.channels.names import (
    can_be_time,
    find_time_index,
    find_time_indices,
    is_clock_name,
    is_time_name,
    rank_clocks,
    split_name_and_unit,
)
from drivetwin.channels.roles import TimeColumn
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.channels.units import is_time_unit, is_unit
from drivetwin.errors import TimeError, Where
from drivetwin.logs.formats.cell_text import is_time_text
from drivetwin.logs.formats.table_head import TableHead, is_physical_unit, is_remark_name

_DATE_NAMES = frozenset(("date", "datum"))


@dataclass(frozen=True)
class TableColumns:
    """Names and units of the columns, and of each the index of its time column.

    `is_packed_clock`: time is a clock without colons, as 101112.05.
    """

    names: Sequence[str]
    units: Sequence[str | None]
    times: Sequence[int]
    is_packed_clock: bool = False
    calendar: tuple[int, ...] = ()
    """Columns of dates with clock times that stand beside a time column in numbers."""

    @cached_property
    def is_paired(self) -> bool:
        """Each channel has a time column of its own name, see `find_pairs`."""
        return len(self.clocks) > 1 and find_pairs(self.names, self.units) is not None

    @cached_property
    def clocks(self) -> list[int]:
        """The time columns; each is its own."""
        return list(dict.fromkeys(self.times))

    @cached_property
    def date(self) -> int | None:
        """Index of the column with the day of each row."""
        days = (i for i, name in enumerate(self.names) if name.casefold() in _DATE_NAMES)
        return next(days, None)


def parse_table_columns(head: TableHead, time: TimeColumn, file: str) -> TableColumns:
    """Return the columns of a table.

    Raises MissingChannelError without a time column, MappingError where there are several.
    """
    cells = list(head.names.cells)
    while len(cells) > 1 and not cells[-1]:
        cells.pop()
    split = [split_name_and_unit(cell) for cell in cells]
    names = [name for name, _ in split]
    units = [unit for _, unit in split]
    below = [_fit(line.cells, len(names)) for line in head.below]
    stated = max(below, key=_count_units, default=[])
    if any(map(is_unit, stated)) or (stated and not any(units)):
        units = [_select_unit(beside, under) for beside, under in zip(units, stated, strict=True)]
    if all(unit is None or is_time_name(name) for name, unit in zip(names, units, strict=True)):
        above = _find_units_above(head, len(names))
        units = [beside or over for beside, over in zip(units, above, strict=True)]
    meant = apply_conventions(head, Columns(names, units))
    calendar = _find_calendar(meant, head, time)
    units = [None if k in calendar else unit for k, unit in enumerate(meant.units)]
    names = ["" if k in calendar else name for k, name in enumerate(meant.names)]
    times = _assign_time_columns(names, units, time, file)
    return TableColumns(meant.names, meant.units, times, meant.is_packed_clock, calendar)


def _find_calendar(meant: Columns, head: TableHead, time: TimeColumn) -> tuple[int, ...]:
    """Find the time columns of texts beside one of numbers, and clocks beside a better one.

    A data frame with an index of dates keeps the time column that it had.
    """
    found = find_time_indices(meant.names, meant.units, time)
    if len(found) < 2 or not head.rows:
        return ()
    if (ranked := rank_clocks(meant.names, found)) and is_clock_name(meant.names[ranked[0]]):
        return tuple(ranked[1:])
    cells = head.rows[0].cells
    texts = tuple(k for k in found if k < len(cells) and is_time_text(cells[k]))
    return texts if len(texts) == len(found) - 1 else ()


def _fit(cells: Sequence[str], width: int) -> list[str]:
    return [*cells[:width], *[""] * (width - len(cells))]


def _find_units_above(head: TableHead, width: int) -> list[str | None]:
    """Units of the columns from a row above the names; its first cell may be a label."""
    for line in reversed(head.above):
        cells = _fit(line.cells, width)
        if (
            width - 1 <= len(line.cells) <= width
            and any(map(is_physical_unit, cells[1:]))
            and all(not cell or is_unit(cell) for cell in cells[1:])
        ):
            first = cells[0] if is_unit(cells[0]) else ""
            return [cell or None for cell in (first, *cells[1:])]
    return [None] * width


def _assign_time_columns(
    names: Sequence[str], units: Sequence[str | None], time: TimeColumn, file: str
) -> list[int]:
    """The index of the time column of each column: the one, or of several the one before it.

    Several count where each stands before columns of its own and is named as the others but for
    digits, as `t1, EngTrq, t2, SpdIn`. Otherwise each channel may have one of its own name, see
    `find_pairs`.
    """
    found = find_time_indices(names, units, time)
    stems = {re.sub(r"[^a-z]", "", names[index].casefold()) for index in found}
    before_others = all(after - one > 1 for one, after in pairwise([*found, len(names)]))
    before = all(not name or is_remark_name(name) for name in names[: found[0]]) if found else False
    if len(found) > 1 and before and len(stems) == 1 and before_others:
        return [
            max((one for one in found if one <= index), default=found[0])
            for index in range(len(names))
        ]
    pairs = find_pairs(names, units) if time.source is None else None
    if pairs is not None:
        first = min(pairs.values())
        return [pairs.get(index, first) for index in range(len(names))]
    return [find_time_index(names, units, time, file)] * len(names)


def _count_units(row: Sequence[str]) -> tuple[int, int]:
    """Count the units in a row below the names: physical units first, then all units.

    Some tools fill a row of comments with `-`, so `-` alone is weak evidence of a row of units.
    """
    return sum(map(is_physical_unit, row)), sum(map(is_unit, row))


def _select_unit(beside: str | None, under: str) -> str | None:
    """Unit of a column from its name and the row below, where a comment or a type may stand.

    If the row below has no unit, or a placeholder such as `-`, the unit in the name is used.
    """
    is_unit = is_physical_unit(under)
    return under if is_unit or (beside is None and under) else beside


_BEFORE = re.compile(
    r"(?:time[ _-]?stamps?|zeitstempel|time|zeit|timestamps?)[ _.\-/:]*(?:of |von )?(.+)"
    r"|t[ _.\-/:]+(.+)|(?:t|time|zeit) ?\((.+)\)",
    re.IGNORECASE,
)
_BEHIND = re.compile(
    r"(.+?)[ _.\-/:]*(?:time[ _-]?stamps?|zeitstempel|timestamps?|time|zeit)|(.+?)[ _.\-/:]+t",
    re.IGNORECASE,
)
_VALUE = re.compile(r"(.+?)[ _.\-/:]*(?:value ?y?|wert|y)", re.IGNORECASE)
"""Name of a column of values where both columns of a pair have a word of their own."""

_LEAST_PAIRS = 2
"""Fewer pairs are no layout: a table with one time column is read as any other."""


def find_pairs(names: Sequence[str], units: Sequence[str | None]) -> Mapping[int, int] | None:
    """Return the time column of each channel of a table of pairs.

    Parameters
    ----------
    names, units : sequence
        Names and units of the columns, in file order.

    Returns
    -------
    mapping of int to int or None
        Index of the time column by the index of each column; a time column is its own. None where
        a named column has no partner or two, since the table then is no table of pairs.
    """
    plain = [name.strip().casefold() for name in names]
    pairs: dict[int, int] = {}
    clocks: set[int] = set()
    for clock, (name, unit) in enumerate(zip(names, units, strict=True)):
        partners = _find_partners(clock, plain, units) if name and can_be_time(unit) else []
        if len(partners) == 1 and partners[0] not in clocks:
            if partners[0] in pairs:
                return None
            pairs[partners[0]] = clock
            clocks.add(clock)
    named = {index for index, name in enumerate(names) if name}
    if len(pairs) < _LEAST_PAIRS or clocks & set(pairs) or named - clocks - set(pairs):
        return None
    return {**pairs, **{clock: clock for clock in clocks}}


def _find_partners(clock: int, plain: Sequence[str], units: Sequence[str | None]) -> list[int]:
    """Return the columns whose time a column may be: none if its name is that of no time."""
    name, unit = plain[clock], units[clock]
    others = [index for index in range(len(plain)) if index != clock and plain[index]]
    if unit is not None and is_time_unit(unit):
        alike = [one for one in others if plain[one] == name and not is_time_unit(units[one] or "")]
        if alike:
            return alike
    stems = {
        stem.strip()
        for form in (_BEFORE, _BEHIND)
        if (match := form.fullmatch(name))
        for stem in match.groups()
        if stem
    }
    exact = [one for one in others if plain[one] in stems]
    return exact or [
        one for one in others if (match := _VALUE.fullmatch(plain[one])) and match[1] in stems
    ]


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
