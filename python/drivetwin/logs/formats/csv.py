# SPDX-License-Identifier: MIT
"""Reader of CSV and TSV logs.

Delimiter `,` `;` `|`, tab or blanks; decimal point or comma; units in a row under the names or in
the names as `EngTrq [Nm]`; comment lines (# % //), the last of which may hold the names; lines of
another form above the names; byte order mark; quoted fields; time as a number or as a clock, with
the date beside it, in one column or, as numbers, in one before each signal or group of signals. An
empty cell is no sample of its column, so each keeps its own time base.
"""

from __future__ import annotations

import codecs
import contextlib
import csv
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drivetwin.channels.names import (
    find_time_index,
    find_time_indices,
    is_time_name,
    split_name_and_unit,
)
from drivetwin.channels.read_options import TimeColumn
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.channels.units import find_unit, get_time_factor, is_unit
from drivetwin.errors import FileFormatError, TimeError, Where
from drivetwin.logs.formats.cell_text import Numbers, detect_decimal_sign, is_number, to_numbers
from drivetwin.logs.origin import describe_origin, find_origin, subtract_origin
from drivetwin.logs.quality.clock_drift import is_clock, parse_clock_column
from drivetwin.logs.raw import RawChannel, RawLog

_DATE_NAMES = frozenset(("date", "datum"))
_COMMENT_MARKS = ("#", "%", "//")
_BLANKS = " "
"""Stands for any number of blanks; every text has some, so it counts only before numbers."""

_SEPARATORS = ("\t", ";", ",", "|", _BLANKS)
"""In the order tried."""

_LOOKED_AT = 200
"""Number of lines used to detect separator and width of the table."""

_MOST_ROWS = 4
"""Rows of names, units, comments and types at most."""

_EXPORT = "export the log as text: one row of names, one of units, then one row for each sample"
_NO_TEXT = re.compile(rb"[\x00-\x08\x0e-\x1f]")


@dataclass(frozen=True)
class _Table:
    """Rows of equal width, with the line of the file on which each ends."""

    rows: Sequence[Sequence[str]]
    lines: Sequence[int]
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Stamps:
    """Time [s] (n,) of the rows that one time column has a stamp for: where `known` (n,)."""

    seconds: FloatArray
    known: NDArray[np.bool_]


@dataclass(frozen=True)
class _Header:
    """Names and units of the columns, and of each the index of its time column."""

    names: Sequence[str]
    units: Sequence[str | None]
    times: Sequence[int]
    height: int
    """Number of header rows: names, optionally units, comments, types."""

    @property
    def clocks(self) -> list[int]:
        """The time columns; each is its own."""
        return list(dict.fromkeys(self.times))


def read_csv(data: bytes, file: str, time: TimeColumn) -> RawLog:
    """Read a text log from its bytes; `file` names it in errors.

    Raises FileFormatError (empty, binary, no header, ragged rows), MissingChannelError (no time
    column), MappingError (several), UnitError and TimeError (time without unit or stamps).
    """
    table = _parse_table(_decode_text(data, file), time, file)
    header = _parse_header(table, time, file)
    body = table.rows[header.height :]
    if not body:
        raise FileFormatError("the file holds names but no samples", _EXPORT, Where(file=file))
    lines = table.lines[header.height :]
    decimal = detect_decimal_sign(body, file)
    cells = list(zip(*body, strict=True))
    columns = [to_numbers(column, lines, decimal) for column in cells]
    days = next((i for i, name in enumerate(header.names) if name.casefold() in _DATE_NAMES), None)
    first, *others = header.clocks
    where = Where(file=file, channel=header.names[first])
    told: tuple[str, ...] = ()
    if others:
        stamps, told = _parse_several_stamps(header, columns, lines, time, file)
    elif is_clock(cells[first][0]):
        dates = None if days is None else cells[days]
        seconds = _parse_clock(cells[first], dates, lines, where)
        stamps = {first: _Stamps(seconds, np.ones(len(body), np.bool_))}
    else:
        counted = _parse_stamps(columns[first], lines, where) * _get_time_factor(
            header, first, time, where
        )
        origin = find_origin(counted[:1])
        told = describe_origin(origin)
        stamps = {first: _Stamps(subtract_origin(counted, origin), columns[first].present)}
    channels, unreadable = _build_channels(header, columns, stamps, without={*stamps, days})
    return RawLog(tuple(channels), unreadable, (*table.warnings, *told), file)


def _build_channels(
    header: _Header,
    columns: Sequence[Numbers],
    stamps: Mapping[int, _Stamps],
    without: set[int | None],
) -> tuple[list[RawChannel], dict[str, str]]:
    channels: list[RawChannel] = []
    unreadable: dict[str, str] = {}
    for index, (name, unit, column) in enumerate(
        zip(header.names, header.units, columns, strict=True)
    ):
        if index in without or (not name and not column.present.any()):
            continue
        time = stamps[header.times[index]]
        present = column.present & time.known
        if column.fault is not None:
            unreadable[name] = column.fault
        elif present.all():
            channels.append(RawChannel(name, unit, time.seconds, column.values))
        else:
            channels.append(RawChannel(name, unit, time.seconds[present], column.values[present]))
    return channels, unreadable


def _decode_text(data: bytes, file: str) -> str:
    """Text of the file; cp1252 where it is no UTF-8, as older tools write ° and µ."""
    where = Where(file=file)
    if not data.strip():
        raise FileFormatError("the file is empty", "record or export the log again", where)
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16", errors="replace")
    if match := _NO_TEXT.search(data):
        what = f"the file is binary or damaged: byte {match.start()} is no text"
        raise FileFormatError(what, _EXPORT, where)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def _parse_table(text: str, time: TimeColumn, file: str) -> _Table:
    """Split into rows; comment and blank lines are left out."""
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    separators: Sequence[str] = _SEPARATORS
    if stated := re.fullmatch(r'"?sep=(.)"?\s*', lines[0]):
        separators = (stated[1],)
        lines[0] = ""
    kept = [
        (number, line)
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.lstrip().startswith(_COMMENT_MARKS)
    ]
    if not kept:
        raise FileFormatError("the file holds only comments", _EXPORT, Where(file=file))
    delimiter, start = _detect_delimiter([line for _, line in kept], separators, time, file)
    above, kept = kept[:start], kept[start:]
    kept = _find_commented_names(lines[: kept[0][0] - 1], delimiter, kept[0][1]) + kept
    numbers = [number for number, _ in kept]
    rows = []
    for number, line in kept:
        try:
            rows.append(_split_strictly(line, delimiter))
        except csv.Error as fault:
            what = f"line {number}: a quoted field does not end where it should ({fault})"
            raise FileFormatError(what, _EXPORT, Where(file=file)) from None
    table = _make_rectangular(rows, numbers, file)
    if not above:
        return table
    note = f"{len(above)} lines above the names left out, the first {above[0][1].strip()[:40]!r}"
    return replace(table, warnings=(note, *table.warnings))


def _find_commented_names(
    lines: Sequence[str], delimiter: str, first: str
) -> list[tuple[int, str]]:
    """Find the comment lines with names, and units if present, above a table without a header.

    They split into as many fields as the `first` line; units are detected by their spelling.
    """
    with contextlib.suppress(csv.Error):
        fields = [cell.strip() for cell in _split_strictly(first, delimiter)]
        if not all(is_number(cell) or is_number(cell, ",") or is_clock(cell) for cell in fields):
            return []
        found: list[tuple[int, str]] = []
        for number, line in enumerate(lines, start=1):
            text = re.sub(r"^\s*(#|%|//)+\s*", "", line)
            cells = _split_strictly(text, delimiter)
            if len(cells) == len(fields) and not any(is_number(cell) for cell in cells):
                found.append((number, text))
        if found and all(
            is_unit(cell) or not cell.strip() for cell in _split_strictly(found[-1][1], delimiter)
        ):
            return found[-2:]
        return found[-1:]
    return []


def _split_strictly(line: str, delimiter: str) -> list[str]:
    """Fields of one line; raises csv.Error where a quote does not close on it."""
    if delimiter == _BLANKS:
        return line.split()
    if '"' not in line:
        return line.split(delimiter)
    reader = csv.reader([line], delimiter=delimiter, skipinitialspace=True, strict=True)
    return next(reader)


def _detect_delimiter(
    lines: Sequence[str], separators: Sequence[str], time: TimeColumn, file: str
) -> tuple[str, int]:
    """The sign that splits most lines into equally many fields, and the line of the names.

    Lines of another form may stand above the names, rows of numbers may not.
    """
    lines = lines[:_LOOKED_AT]
    for sign in separators:
        rows = [_split_line(line, sign) for line in lines]
        data = [_is_data_line(line, sign) for line in lines]
        start = _find_names_row(rows, data, time)
        if start is not None and (sign != _BLANKS or any(data)):
            return sign, start
    if len(separators) == 1:
        return separators[0], 0
    raise FileFormatError(
        f"no columns found: no tab, semicolon, comma, bar or blank splits {lines[0][:60]!r} and "
        "the lines below alike",
        _EXPORT,
        Where(file=file),
    )


def _find_names_row(
    rows: Sequence[Sequence[str]], data: Sequence[bool], time: TimeColumn
) -> int | None:
    """The row of the names above the `data`: the fullest with a name for time, else the first.

    Rows above it may be as wide where a program fills all up with separators.
    """
    usual = max(Counter(map(len, rows)).items(), key=lambda item: (item[1], item[0]))[0]
    last = all(not row[-1].strip() for row in rows if len(row) == usual)
    above = rows[: max(1, data.index(True) if True in data else len(data))]
    may = [index for index, row in enumerate(above) if _can_be_names_row(row, usual, last)]
    timed = [index for index in may if _has_time_name(rows[index], time)]
    return max(timed, key=lambda index: _count_cells(rows[index]), default=next(iter(may), None))


def _has_time_name(row: Sequence[str], time: TimeColumn) -> bool:
    """Return True if a row contains a name for time."""
    names = (split_name_and_unit(cell.strip())[0] for cell in row)
    return any(is_time_name(name) if time.source is None else name == time.source for name in names)


def _count_cells(row: Sequence[str]) -> int:
    """Fields up to the last that is not blank."""
    return max((index for index, cell in enumerate(row, start=1) if cell.strip()), default=0)


def _split_line(line: str, delimiter: str) -> list[str]:
    """Fields of a line; a single empty one where a quote does not close."""
    with contextlib.suppress(csv.Error):
        return _split_strictly(line, delimiter)
    return [""]


def _can_be_names_row(row: Sequence[str], usual: int, last_empty: bool) -> bool:
    """Return True if a row has the usual width, except for a separator at the line's end.

    `last_empty`: the rows of the `usual` width end in such a separator.
    """
    ends = len(row) == usual + 1 and not row[-1].strip()
    return len(row) > 1 and (len(row) == usual or ends or (len(row) == usual - 1 and last_empty))


def _is_data_line(line: str, delimiter: str) -> bool:
    """Return True if a line has several fields and starts with a number or a clock time."""
    cells = line.split() if delimiter == _BLANKS else line.split(delimiter)
    first = cells[0].strip()
    return len(cells) > 1 and (is_number(first) or is_number(first, ",") or is_clock(first))


def _make_rectangular(rows: list[list[str]], lines: Sequence[int], file: str) -> _Table:
    """Rows as wide as the names: empty fields at line ends go, a cut last line is left out."""
    while len(rows[0]) > 1 and not rows[0][-1].strip():
        rows[0].pop()
    width = len(rows[0])
    warnings: tuple[str, ...] = ()
    if len(rows) > 2 and len(rows[-1]) < width:
        text = f"line {lines[-1]}, the last, has {len(rows[-1])} of {width} fields and is left out"
        warnings = (f"the file is cut: {text}",)
        rows, lines = rows[:-1], lines[:-1]
    for row, line in zip(rows, lines, strict=True):
        if len(row) == width:
            continue
        if len(row) < width or any(cell.strip() for cell in row[width:]):
            raise FileFormatError(
                f"line {line} has {len(row)} fields, the names have {width}", _EXPORT,
                Where(file=file),
            )  # fmt: skip
        del row[width:]
    return _Table(rows, lines, warnings)


def _parse_header(table: _Table, time: TimeColumn, file: str) -> _Header:
    cells = [cell.strip() for cell in table.rows[0]]
    if all(is_number(cell) or is_number(cell, ",") for cell in cells if cell):
        raise FileFormatError(
            f"line {table.lines[0]} holds numbers where the names should stand",
            _EXPORT,
            Where(file=file),
        )
    split = [split_name_and_unit(cell) for cell in cells]
    names = [name for name, _ in split]
    units = [unit for _, unit in split]
    below = _count_rows_below(table, find_time_indices(names, units, time))
    stated = max(below, key=_count_units, default=[])
    if any(map(is_unit, stated)) or (stated and not any(units)):
        units = [_select_unit(beside, under) for beside, under in zip(units, stated, strict=True)]
    return _Header(
        names, units, _assign_time_columns(names, units, time, file), height=1 + len(below)
    )


def _count_rows_below(table: _Table, times: Sequence[int]) -> list[list[str]]:
    """Rows of units, comments or types between the names and the first row of numbers.

    Of units only the first may hold numbers: that of a fraction, `1`, but not for time.
    """
    below: list[list[str]] = []
    for row in table.rows[1:_MOST_ROWS]:
        looked_at = (
            row if below else [*(row[i] for i in times), *(c for c in row if not is_unit(c))]
        )
        if any(is_number(cell) or is_number(cell, ",") or is_clock(cell) for cell in looked_at):
            break
        below.append([cell.strip() for cell in row])
    return below


def _assign_time_columns(
    names: Sequence[str], units: Sequence[str | None], time: TimeColumn, file: str
) -> list[int]:
    """The index of the time column of each column: the one, or of several the one before it.

    Several count where each stands before columns of its own and is named as the others but for
    digits, as `t1, EngTrq, t2, SpdIn`.
    """
    found = find_time_indices(names, units, time)
    stems = {re.sub(r"[^a-z]", "", names[index].casefold()) for index in found}
    before_others = all(after - one > 1 for one, after in pairwise([*found, len(names)]))
    if len(found) > 1 and found[0] == 0 and len(stems) == 1 and before_others:
        return [max(one for one in found if one <= index) for index in range(len(names))]
    return [find_time_index(names, units, time, file)] * len(names)


def _count_units(row: Sequence[str]) -> tuple[int, int]:
    """Count the units in a row below the names: physical units first, then all units.

    Some tools fill a row of comments with `-`, so `-` alone is weak evidence of a row of units.
    """
    return sum(map(_is_physical_unit, row)), sum(map(is_unit, row))


def _is_physical_unit(cell: str) -> bool:
    """Return True if a cell is a unit other than that of a dimensionless number."""
    return is_unit(cell) and find_unit(cell) != find_unit("-")


def _select_unit(beside: str | None, under: str) -> str | None:
    """Unit of a column from its name and the row below, where a comment or a type may stand.

    If the row below has no unit, or a placeholder such as `-`, the unit in the name is used.
    """
    tells = _is_physical_unit(under)
    return under if tells or (beside is None and under) else beside


def _parse_clock(
    cells: Sequence[str], dates: Sequence[str] | None, lines: Sequence[int], where: Where
) -> FloatArray:
    """Convert a column of clock times to seconds (n,) since the first row."""
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


def _parse_stamps(column: Numbers, lines: Sequence[int], where: Where) -> FloatArray:
    if not _require_numbers(column, where).present.all():
        raise _make_stamp_error(lines[int(column.present.argmin())], where)
    return column.values


def _require_numbers(column: Numbers, where: Where) -> Numbers:
    """A time column; raises TimeError where it holds something else than numbers."""
    if column.fault is not None:
        remedy = "export time as seconds since the start of the recording"
        raise TimeError(f"no time stamp: {column.fault}", remedy, where)
    return column


def _make_stamp_error(line: int, where: Where) -> TimeError:
    return TimeError(f"line {line} has no time stamp", "remove the line", where)


def _parse_several_stamps(
    header: _Header,
    columns: Sequence[Numbers],
    lines: Sequence[int],
    time: TimeColumn,
    file: str,
) -> tuple[dict[int, _Stamps], tuple[str, ...]]:
    """Return the stamps of each of several time columns, from a common origin, and warnings.

    A shorter one ends in blanks or NaN; no value may stand beside these.
    """
    counted: dict[int, FloatArray] = {}
    for clock in header.clocks:
        where = Where(file=file, channel=header.names[clock])
        column = _require_numbers(columns[clock], where)
        counted[clock] = column.values * _get_time_factor(header, clock, time, where)
    known = {clock: np.isfinite(stamps) for clock, stamps in counted.items()}
    origin = find_origin(
        float(one) for clock in counted for one in counted[clock][known[clock]][:1]
    )
    for index, column in enumerate(columns):
        bare = ~known[header.times[index]] & np.isfinite(column.values)
        if bare.any():
            raise _make_stamp_error(
                lines[int(bare.argmax())], Where(file=file, channel=header.names[index])
            )
    named = ", ".join(header.names[clock] for clock in header.clocks)
    note = f"several time columns, each for the columns that follow it: {named}"
    stamps = {
        clock: _Stamps(subtract_origin(counted[clock], origin), known[clock]) for clock in counted
    }
    return stamps, (note, *describe_origin(origin))


def _get_time_factor(header: _Header, clock: int, time: TimeColumn, where: Where) -> float:
    return get_time_factor(time.unit if time.unit is not None else header.units[clock], where)
