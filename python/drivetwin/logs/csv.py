# SPDX-License-Identifier: MIT
"""Reader of CSV and TSV logs.

Delimiter `,` `;` `|`, tab or blanks; decimal point or comma; units in a row under the names or in
the names as `EngTrq [Nm]`; comment lines (# % //), the last of which may hold the names; lines of
another form above the names; byte order mark; quoted fields; time as a number or as a clock, with
the date beside it. An empty cell is no sample of its column, so each keeps its own time base.
"""

from __future__ import annotations

import codecs
import contextlib
import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

from drivetwin.errors import FileFormatError, TimeError, Where
from drivetwin.logs.cells import Numbers, decimal_sign, is_number, to_numbers
from drivetwin.logs.clock import clock_seconds, is_clock
from drivetwin.logs.names import name_and_unit, time_index
from drivetwin.logs.origin import origin_of, origin_told, since
from drivetwin.logs.raw import RawChannel, RawLog, TimeColumn
from drivetwin.logs.shiftlog import FloatArray
from drivetwin.logs.units import is_unit, lookup, time_factor

_DATE_NAMES = frozenset(("date", "datum"))
_COMMENT_MARKS = ("#", "%", "//")
_BLANKS = " "
"""Stands for any number of blanks; every text has some, so it counts only before numbers."""

_SEPARATORS = ("\t", ";", ",", "|", _BLANKS)
"""In the order tried."""

_LOOKED_AT = 200
"""Lines from which separator and width of the table are told."""

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


@dataclass(frozen=True)
class _Header:
    """Names and units of the columns and the index of the time column."""

    names: Sequence[str]
    units: Sequence[str | None]
    time: int
    height: int
    """How many rows it takes: names, perhaps units, comments, types."""


def read_csv(data: bytes, file: str, time: TimeColumn) -> RawLog:
    """Read a text log from its bytes; `file` names it in errors.

    Raises FileFormatError (empty, binary, no header, ragged rows), MissingChannelError (no time
    column), MappingError (several), UnitError and TimeError (time without unit or stamps).
    """
    table = _table(_decode(data, file), file)
    header = _header(table, time, file)
    body = table.rows[header.height :]
    if not body:
        raise FileFormatError("the file holds names but no samples", _EXPORT, Where(file=file))
    lines = table.lines[header.height :]
    decimal = decimal_sign(body, file)
    cells = list(zip(*body, strict=True))
    columns = [to_numbers(column, lines, decimal) for column in cells]
    where = Where(file=file, channel=header.names[header.time])
    days = next((i for i, name in enumerate(header.names) if name.casefold() in _DATE_NAMES), None)
    warnings = table.warnings
    if is_clock(cells[header.time][0]):
        dates = None if days is None else cells[days]
        seconds = _clock(cells[header.time], dates, lines, where)
    else:
        unit = time.unit if time.unit is not None else header.units[header.time]
        stamps = _stamps(columns[header.time], lines, where) * time_factor(unit, where)
        origin = origin_of(stamps[:1])
        seconds, warnings = since(stamps, origin), (*warnings, *origin_told(origin))
    channels, unreadable = _channels(header, columns, seconds, without={header.time, days})
    return RawLog(tuple(channels), unreadable, warnings, file)


def _channels(
    header: _Header, columns: Sequence[Numbers], seconds: FloatArray, without: set[int | None]
) -> tuple[list[RawChannel], dict[str, str]]:
    channels: list[RawChannel] = []
    unreadable: dict[str, str] = {}
    for index, (name, unit, column) in enumerate(
        zip(header.names, header.units, columns, strict=True)
    ):
        if index in without or (not name and not column.present.any()):
            continue
        if column.fault is not None:
            unreadable[name] = column.fault
        elif column.present.all():
            channels.append(RawChannel(name, unit, seconds, column.values))
        else:
            present = column.present
            channels.append(RawChannel(name, unit, seconds[present], column.values[present]))
    return channels, unreadable


def _decode(data: bytes, file: str) -> str:
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


def _table(text: str, file: str) -> _Table:
    """Split into rows; comment and blank lines are left out."""
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    delimiter = None
    if stated := re.fullmatch(r"sep=(.)", lines[0].strip()):
        delimiter = stated[1]
        lines[0] = ""
    kept = [
        (number, line)
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.lstrip().startswith(_COMMENT_MARKS)
    ]
    if not kept:
        raise FileFormatError("the file holds only comments", _EXPORT, Where(file=file))
    above: list[tuple[int, str]] = []
    if delimiter is None:
        delimiter, start = _delimiter([line for _, line in kept], file)
        above, kept = kept[:start], kept[start:]
    kept = _names_in_comments(lines[: kept[0][0] - 1], delimiter, kept[0][1]) + kept
    numbers = [number for number, _ in kept]
    rows = []
    for number, line in kept:
        try:
            rows.append(_fields(line, delimiter))
        except csv.Error as fault:
            what = f"line {number}: a quoted field does not end where it should ({fault})"
            raise FileFormatError(what, _EXPORT, Where(file=file)) from None
    table = _even(rows, numbers, file)
    if not above:
        return table
    note = f"{len(above)} lines above the names left out, the first {above[0][1].strip()[:40]!r}"
    return replace(table, warnings=(note, *table.warnings))


def _names_in_comments(lines: Sequence[str], delimiter: str, first: str) -> list[tuple[int, str]]:
    """The comment lines with names, and perhaps units below, of a table that starts with numbers.

    They split into as many fields as the `first` line; units are told by their spelling.
    """
    with contextlib.suppress(csv.Error):
        fields = [cell.strip() for cell in _fields(first, delimiter)]
        if not all(is_number(cell) or is_number(cell, ",") or is_clock(cell) for cell in fields):
            return []
        found: list[tuple[int, str]] = []
        for number, line in enumerate(lines, start=1):
            text = re.sub(r"^\s*(#|%|//)+\s*", "", line)
            cells = _fields(text, delimiter)
            if len(cells) == len(fields) and not any(is_number(cell) for cell in cells):
                found.append((number, text))
        if found and all(
            is_unit(cell) or not cell.strip() for cell in _fields(found[-1][1], delimiter)
        ):
            return found[-2:]
        return found[-1:]
    return []


def _fields(line: str, delimiter: str) -> list[str]:
    """Fields of one line; raises csv.Error where a quote does not close on it."""
    if delimiter == _BLANKS:
        return line.split()
    if '"' not in line:
        return line.split(delimiter)
    reader = csv.reader([line], delimiter=delimiter, skipinitialspace=True, strict=True)
    return next(reader)


def _delimiter(lines: Sequence[str], file: str) -> tuple[str, int]:
    """The sign that splits most lines into equally many fields, and the line of the names.

    Lines of another form may stand above the names, rows of numbers may not.
    """
    lines = lines[:_LOOKED_AT]
    for sign in _SEPARATORS:
        rows = [_split(line, sign) for line in lines]
        usual = max(Counter(map(len, rows)).items(), key=lambda item: (item[1], item[0]))[0]
        last = all(not row[-1].strip() for row in rows if len(row) == usual)
        start = next((i for i, row in enumerate(rows) if _may_be_names(row, usual, last)), None)
        data = [_is_data(line, sign) for line in lines]
        if start is not None and not any(data[:start]) and (sign != _BLANKS or any(data)):
            return sign, start
    raise FileFormatError(
        f"no columns found: no tab, semicolon, comma, bar or blank splits {lines[0][:60]!r} and "
        "the lines below alike",
        _EXPORT,
        Where(file=file),
    )


def _split(line: str, delimiter: str) -> list[str]:
    """Fields of a line; a single empty one where a quote does not close."""
    with contextlib.suppress(csv.Error):
        return _fields(line, delimiter)
    return [""]


def _may_be_names(row: Sequence[str], usual: int, last_empty: bool) -> bool:
    """Whether a row is as wide as the others but for a separator at the line's end.

    `last_empty`: the others of the `usual` width have one.
    """
    ends = len(row) == usual + 1 and not row[-1].strip()
    return len(row) > 1 and (len(row) == usual or ends or (len(row) == usual - 1 and last_empty))


def _is_data(line: str, delimiter: str) -> bool:
    """Whether a line holds several fields and starts with a number or a clock."""
    cells = line.split() if delimiter == _BLANKS else line.split(delimiter)
    first = cells[0].strip()
    return len(cells) > 1 and (is_number(first) or is_number(first, ",") or is_clock(first))


def _even(rows: list[list[str]], lines: Sequence[int], file: str) -> _Table:
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


def _header(table: _Table, time: TimeColumn, file: str) -> _Header:
    cells = [cell.strip() for cell in table.rows[0]]
    if all(is_number(cell) or is_number(cell, ",") for cell in cells if cell):
        raise FileFormatError(
            f"line {table.lines[0]} holds numbers where the names should stand",
            _EXPORT,
            Where(file=file),
        )
    split = [name_and_unit(cell) for cell in cells]
    names = [name for name, _ in split]
    units = [unit for _, unit in split]
    index = time_index(names, time, file)
    below: list[list[str]] = []
    for row in table.rows[1:_MOST_ROWS]:
        # A unit may be the number 1; what stands below it is a row of numbers if any cell is one.
        looked_at = row if below else [row[index]]
        if any(is_number(cell) or is_number(cell, ",") or is_clock(cell) for cell in looked_at):
            break
        below.append([cell.strip() for cell in row])
    stated = max(below, key=lambda row: sum(map(is_unit, row)), default=[])
    if any(map(is_unit, stated)) or (stated and not any(units)):
        units = [_unit(beside, under) for beside, under in zip(units, stated, strict=True)]
    return _Header(names, units, index, height=1 + len(below))


def _unit(beside: str | None, under: str) -> str | None:
    """Unit of a column from its name and the row below, where a comment or a type may stand.

    What is no unit, or says that there is none, as `-`, leaves the name its unit.
    """
    tells = is_unit(under) and lookup(under) != lookup("-")
    return under if tells or (beside is None and under) else beside


def _clock(
    cells: Sequence[str], dates: Sequence[str] | None, lines: Sequence[int], where: Where
) -> FloatArray:
    """Seconds (n,) since the first row of a column that shows a clock."""
    seconds, count = clock_seconds(cells, dates)
    if count < seconds.size:
        remedy = "export time as seconds since the start of the recording"
        cell, word = cells[count], "clock time"
        if dates is not None and is_clock(cell):  # the day beside it is at fault
            cell, word = dates[count], "date that can be read"
            remedy = f"write it as 2024-05-31 or 31.05.2024, or {remedy}"
        what = f"no time stamp: line {lines[count]}: {cell.strip()[:40]!r} is no {word}"
        raise TimeError(what, remedy, where)
    return seconds


def _stamps(column: Numbers, lines: Sequence[int], where: Where) -> FloatArray:
    if column.fault is not None:
        remedy = "export time as seconds since the start of the recording"
        raise TimeError(f"no time stamp: {column.fault}", remedy, where)
    if not column.present.all():
        line = lines[int(column.present.argmin())]
        raise TimeError(f"line {line} has no time stamp", "remove the line", where)
    return column.values
