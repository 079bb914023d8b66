# SPDX-License-Identifier: MIT
"""Long tables: one row for each reading, with its time, the name of its channel and its value.

Databases, `melt` of pandas and OBD apps (Car Scanner: `SECONDS;PID;VALUE;UNITS`) write them. They
are recognised by structure: a time column, a column of names, a column of numbers, and optionally
a column of units. The words of the head decide only where the rows leave a choice.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin._native import ScannedTable
from drivetwin.channels.names import find_time_indices, is_time_name, split_name_and_unit
from drivetwin.channels.roles import TimeColumn
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.channels.units import get_time_factor, is_time_unit, is_unit
from drivetwin.errors import FileFormatError, TimeError, Where
from drivetwin.logs.formats.cell_text import (
    Meaning,
    classify_text,
    is_clock,
    is_number,
    is_time_text,
    parse_time_texts,
)
from drivetwin.logs.formats.table_head import TableHead, TextFile, is_remark_name
from drivetwin.logs.formats.table_scan import (
    FIRST_TEXT,
    OTHER_TEXT,
    TableReader,
    list_contents,
    list_texts,
    make_numbers,
    number_lines,
)
from drivetwin.logs.raw import RawChannel, RawLog, describe_origin, find_origin, subtract_origin

_NAME_WORDS = frozenset(
    (
        *(
            "name",
            "names",
            "channel",
            "channelname",
            "kanal",
        ),
        *(
            "kanalname",
            "signal",
            "signalname",
            "variable",
            "variablenname",
        ),
        *(
            "parameter",
            "pid",
            "sensor",
            "tag",
            "tagname",
        ),
        *(
            "field",
            "metric",
            "quantity",
            "measurement",
            "messgröße",
        ),
        *(
            "messgrösse",
            "item",
            "key",
            "id",
            "label",
        ),
        *("bezeichnung",),
    )
)
_VALUE_WORDS = frozenset(
    (
        *(
            "value",
            "values",
            "val",
            "wert",
            "werte",
        ),
        *(
            "messwert",
            "reading",
            "readings",
            "data",
            "y",
        ),
        *("physvalue",),
    )
)
_UNIT_WORDS = frozenset(
    (
        *(
            "unit",
            "units",
            "einheit",
            "einheiten",
            "uom",
        ),
    )
)

_LEAST_ROWS = 4
"""Rows that show the structure: fewer are no evidence of a repeated name [count]."""

_EXPORT = "export the log with one column for each channel"


@dataclass(frozen=True)
class LongLayout:
    """Indices of the columns of a long table; `width` counts all, `unit` is None without units."""

    time: int
    name: int
    value: int
    unit: int | None
    width: int
    time_unit: str | None


def find_long_layout(head: TableHead, time: TimeColumn, file: str) -> LongLayout | None:
    """Return the layout of a long table, or None for a table with a column for each channel.

    A table is long if it has nothing but time, name, value and unit. Texts beside one number may
    also be the states of a gear lever. So the head must call them names, or a column of units must
    be beside them and they must repeat. Raises FileFormatError for readings with further columns,
    whose meaning is open.
    """
    cells = list(head.names.cells)
    while len(cells) > 1 and not cells[-1]:
        cells.pop()
    split = [_split_time_word(cell) for cell in cells]
    names, units = [name for name, _ in split], [unit for _, unit in split]
    width = len(names)
    rows = [row.cells for row in head.rows if width <= len(row.cells)]
    found = find_time_indices(names, units, time)
    if not found and time.source is None:
        found = [index for index, unit in enumerate(units) if unit and is_time_unit(unit)]
    if len(found) != 1 or width < 3 or len(rows) < _LEAST_ROWS:
        return None
    others = [index for index in range(width) if index != found[0] and names[index]]
    others = [index for index in others if not is_remark_name(names[index])]
    texts = [index for index in others if _holds_names([row[index] for row in rows])]
    unit = _pick_unit(texts, names, rows)
    name = _pick(texts, [unit], names, _NAME_WORDS)
    value = _pick(others, [unit, name], names, _VALUE_WORDS)
    if name is None or value is None or name == value:
        return None
    if not any(is_number(row[value]) for row in rows):
        return None
    left = [names[index] for index in others if index not in (unit, name, value)]
    is_stated = _fold(names[name]) in _NAME_WORDS and _fold(names[value]) in _VALUE_WORDS
    if left and is_stated and name in texts:
        raise FileFormatError(
            f"each row is one reading, of the channel in column {names[name]!r}, with further "
            f"columns: {', '.join(left)}",
            f"{_EXPORT}, or with the columns time, name, value and unit only",
            Where(file=file),
        )
    if left:
        return None
    labels = [row[name] for row in rows]
    is_named = _fold(names[name]) in _NAME_WORDS
    if not is_named and (unit is None or len(set(labels)) == len(labels)):
        return None
    return LongLayout(found[0], name, value, unit, width, units[found[0]])


def _split_time_word(cell: str) -> tuple[str, str | None]:
    """Name and unit of a column; `SECONDS` is a time in the unit that it names."""
    name, unit = split_name_and_unit(cell)
    if unit is None and len(name) > 1 and is_time_unit(name) and not is_time_name(name):
        return name, name
    return name, unit


def _fold(name: str) -> str:
    return re.sub(r"[\W_\d]", "", name.casefold())


def _holds_names(cells: Sequence[str]) -> bool:
    """Return True for cells with a text in each, or blank: names of channels or units."""
    filled = [cell for cell in cells if cell]
    words = [cell for cell in filled if not is_number(cell) and not is_time_text(cell)]
    named = [cell for cell in words if classify_text(cell) is Meaning.TEXT or is_unit(cell)]
    return bool(filled) and len(named) == len(filled)


def _pick_unit(
    texts: Sequence[int], names: Sequence[str], rows: Sequence[Sequence[str]]
) -> int | None:
    """Column of units: named as such, else the only one of several whose cells all are units."""
    stated = [index for index in range(len(names)) if _fold(names[index]) in _UNIT_WORDS]
    if len(stated) == 1:
        return stated[0]
    spelled = [one for one in texts if all(not row[one] or is_unit(row[one]) for row in rows)]
    return spelled[0] if len(spelled) == 1 and len(texts) > 1 else None


def _pick(
    among: Sequence[int],
    taken: Sequence[int | None],
    names: Sequence[str],
    words: frozenset[str],
) -> int | None:
    """Return the only column left, or of several the one whose name is one of `words`."""
    free = [index for index in among if index not in taken]
    if len(free) == 1:
        return free[0]
    worded = [index for index in free if _fold(names[index]) in words]
    return worded[0] if len(worded) == 1 else None


def read_long(text: TextFile, head: TableHead, layout: LongLayout, time: TimeColumn) -> RawLog:
    """Read a long table: each channel in its own unit, with its own stamps.

    Raises FileFormatError for a damaged table, and for a channel with two units; TimeError for a
    row without a stamp; UnitError for a time without a unit.
    """
    stamp = next((row.cells[layout.time] for row in head.rows if row.cells[layout.time :]), "")
    is_text = is_time_text(stamp)
    reader = TableReader(text, head, layout.width, layout.time, is_text)
    texts = [index for index in (layout.name, layout.unit) if index is not None]
    numbers = [layout.value] if is_text else [layout.time, layout.value]
    rows = text.estimate_lines([row.text for row in head.rows])
    table = reader.scan(numbers, [*texts, layout.time] if is_text else texts, rows)
    notes = reader.check(table)
    seconds, origin = _read_stamps(reader, table, layout, time, len(texts) if is_text else None)
    labels = np.array(list_texts(table, 0, text), dtype=object)
    if not all(labels):
        what = f"line {_number_row(table, int(np.argmax(labels == '')))} names no channel"
        raise FileFormatError(what, _EXPORT, Where(file=text.file))
    units = None if layout.unit is None else list_texts(table, 1, text)
    channels, unreadable = _split_channels(
        _Readings(seconds, labels, units), reader, table, layout.value
    )
    shape = f"one row for each reading: {len(channels) + len(unreadable)} channels by name"
    return RawLog(channels, unreadable, (*notes, shape, *origin), text.file)


@dataclass(frozen=True, eq=False)
class _Readings:
    """Rows of a long table: time [s] (n,), channel (n,), and units as written if it has any."""

    seconds: FloatArray
    labels: NDArray[np.object_]
    units: Sequence[str] | None


def _read_stamps(
    reader: TableReader,
    table: ScannedTable,
    layout: LongLayout,
    time: TimeColumn,
    place: int | None,
) -> tuple[FloatArray, tuple[str, ...]]:
    """Return time [s] (n,) from numbers, or from the texts at `place`, and warnings."""
    where = Where(file=reader.text.file, channel=reader.head.names.cells[layout.time])
    if place is not None:
        cells = list_texts(table, place, reader.text)
        if is_clock(cells[0]) and not re.search(r"\d[-/]\d|\d\.\d+\.\d", cells[0]):
            what = "rows of readings with a clock time and no date: midnight cannot be found"
            raise TimeError(what, "export time in seconds or with its date", where)
        lines = number_lines(table.lines, np.arange(table.rows)).tolist()
        return parse_time_texts(cells, None, lines, where), ()
    contents = list_contents(table, reader.text)[layout.time]
    if contents.fault is not None:
        remedy = "export time as seconds since the start of the recording"
        raise TimeError(f"no time stamp: {contents.fault}", remedy, where)
    column = make_numbers(*table.take_numbers(layout.time), contents)
    if not column.present.all():
        line = _number_row(table, int(np.argmin(column.present)))
        raise TimeError(f"line {line} has no time stamp", "remove the line", where)
    stated = time.unit if time.unit is not None else layout.time_unit
    counted = column.values * get_time_factor(stated, where)
    origin = find_origin([float(np.nanmin(counted))] if np.isfinite(counted).any() else [])
    return subtract_origin(counted, origin), describe_origin(origin)


def _split_channels(
    readings: _Readings, reader: TableReader, table: ScannedTable, value: int
) -> tuple[tuple[RawChannel, ...], dict[str, str]]:
    """Return the channels in order of appearance, and the reason for each without numbers."""
    contents = list_contents(table, reader.text)[value]
    values, kinds = table.take_numbers(value)
    column = make_numbers(values, kinds, contents)
    words = [index for index, cell in enumerate(contents.texts)
             if classify_text(cell) is Meaning.TEXT]  # fmt: skip
    is_word = np.zeros(table.rows, np.bool_)
    if kinds.size:
        is_word = np.isin(kinds, [OTHER_TEXT, *(FIRST_TEXT + index for index in words)])
    channels, unreadable = [], {}
    for label, places in _group_rows(readings.labels).items():
        if is_word[places].any():
            line = _number_row(table, int(places[is_word[places].argmax()]))
            unreadable[label] = f"line {line}: a value of {label!r} is no number"
            continue
        mine = places[column.present[places]]
        name, unit = split_name_and_unit(label)
        if readings.units is not None:
            unit = _get_unit([readings.units[place] for place in places], label, reader) or unit
        channels.append(RawChannel(name, unit, readings.seconds[mine], column.values[mine]))
    return tuple(channels), unreadable


def _group_rows(labels: NDArray[np.object_]) -> dict[str, NDArray[np.intp]]:
    """Return the rows of each label, labels in order of appearance."""
    order = {label: index for index, label in enumerate(dict.fromkeys(labels.tolist()))}
    codes = np.array([order[label] for label in labels.tolist()], np.intp)
    by_code = np.argsort(codes, kind="stable")
    starts = np.searchsorted(codes[by_code], np.arange(1, len(order)))
    return dict(zip(order, np.split(by_code, starts), strict=True))


def _get_unit(stated: Sequence[str], label: str, reader: TableReader) -> str | None:
    """Return the one unit of a channel; raises FileFormatError where its rows have two."""
    units = list(dict.fromkeys(unit for unit in stated if unit))
    if len(units) > 1:
        raise FileFormatError(
            f"the rows of {label!r} are in {units[0]!r} and in {units[1]!r}",
            "export each channel in one unit",
            Where(file=reader.text.file, channel=label),
        )
    return units[0] if units else None


def _number_row(table: ScannedTable, row: int) -> int:
    """Return the line of the file on which a row is."""
    return int(number_lines(table.lines, np.array([row]))[0])
