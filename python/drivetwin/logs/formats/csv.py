# SPDX-License-Identifier: MIT
"""Reader of CSV and TSV logs.

Delimiter `,` `;` `|`, tab or blanks; decimal point or comma; units in a row under or above the
names or in the names as `EngTrq [Nm]`; comment lines (# % //), the last of which may hold the
names; lines of another format above the names and between the rows; byte order mark; quoted fields;
time as a number, a duration or a clock, with the date beside it, in one column or, as numbers, in
one before each signal or group of signals, or one beside each signal. Empty cells are ignored, so
that each column keeps its own time base. Tables of readings are read by `long_table`.

The rows are read in passes of the native scanner: one for their form and the stamps, others for the
channels that are asked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from drivetwin._native import ScannedTable
from drivetwin.channels.roles import Column, ReadOptions, TimeColumn
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.channels.units import get_time_factor
from drivetwin.errors import DamagedChannelError, TimeError, Where
from drivetwin.logs.formats.cell_text import is_time_text, parse_time_texts, read_flag
from drivetwin.logs.formats.long_table import find_long_layout, read_long
from drivetwin.logs.formats.table_columns import TableColumns, parse_table_columns, unpack_clock
from drivetwin.logs.formats.table_head import (
    TableHead,
    TextFile,
    find_table_head,
    is_remark_name,
    open_text,
)
from drivetwin.logs.formats.table_scan import (
    Contents,
    Numbers,
    TableReader,
    list_contents,
    list_texts,
    make_numbers,
    number_lines,
)
from drivetwin.logs.raw import (
    RawChannel,
    Recording,
    Window,
    describe_origin,
    find_origin,
    subtract_origin,
)

_MOST_CELLS = 4 * 10**7
"""Cells that are kept at a time: all of most logs, eleven columns of one hour at 1 kHz."""


@dataclass(frozen=True, eq=False)
class _Stamps:
    """Time [s] (n,) of the rows that one time column has a stamp for: where `known` (n,)."""

    seconds: FloatArray
    known: NDArray[np.bool_]


@contextmanager
def open_csv(path: Path, options: ReadOptions) -> Iterator[Recording]:
    """Open a text log; see `CsvRecording`."""
    with path.open("rb") as source:
        yield read_table(source, str(path), options.time)


def read_table(source: BinaryIO, file: str, time: TimeColumn) -> Recording:
    """Read a text log of either layout: one column, or one row, for each sample of a channel."""
    text = open_text(source, file)
    head = find_table_head(text.read_head(), time, file)
    layout = find_long_layout(head, time, file)
    return CsvRecording(text, head, time) if layout is None else read_long(text, head, layout, time)


class CsvRecording:
    """Columns of a text log with a column for each channel.

    Raises FileFormatError (empty, binary, no header, ragged rows), MissingChannelError (no time
    column), MappingError (several), UnitError and TimeError (time without unit or stamps).
    """

    def __init__(self, text: TextFile, head: TableHead, time: TimeColumn) -> None:
        file = text.file
        self._header = parse_table_columns(head, time, file)
        first = self._header.clocks[0]
        stamp = next((row.cells[first] for row in head.rows if _has_text(row.cells, first)), "")
        is_text = len(self._header.clocks) == 1 and is_time_text(stamp)
        self._reader = TableReader(text, head, len(self._header.names), first, is_text)
        clocks = self._header.clocks
        dates = [] if self._header.date is None else [self._header.date]
        rows, width = text.estimate_lines([row.text for row in head.rows]), len(self._header.names)
        at_once = rows * width <= _MOST_CELLS
        numbers = range(width) if at_once else () if is_text else clocks
        table = self._reader.scan(numbers, [first, *dates] if is_text else (), rows)
        notes = self._reader.check(table)
        self._rows = table.rows
        self._lines = table.lines
        self._contents = list_contents(table, text)
        self._kept: dict[int, Numbers] = {}
        stamps = _TimeColumns(self._header, self._lines, time, file)
        notices: tuple[str, ...] = ()
        if is_text:
            self._stamps = stamps.parse_texts(table, text, bool(dates))
        else:
            self._stamps, notices = self._count_stamps(stamps, self._take_numbers(table, clocks))
        if self._header.calendar:
            names = self._header.names
            left = ", ".join(names[index] for index in self._header.calendar)
            notices += (f"several time columns: {names[clocks[0]]} is used, not {left}",)
        self.warnings: tuple[str, ...] = (*notes, *notices)
        others = [index for index in range(len(self._header.names)) if self._is_channel(index)]
        self._flags = self._find_flags(others)
        numbered = [index for index in others if self._contents[index].fault is None]
        sound = sorted([*numbered, *self._flags])
        faulty = [index for index in others if index not in sound]
        self._places = (*sound, *faulty)
        names, units = self._header.names, self._header.units
        if at_once:
            self._kept = self._take_numbers(table, numbered)
        self.columns = (
            *(Column(names[index], units[index]) for index in sound),
            *(Column(names[index], empty=True) for index in faulty),
        )

    def load(self, index: int, window: Window | None = None) -> RawChannel:
        """Return a column; raises DamagedChannelError where it holds texts. See `Recording`."""
        place = self._places[index]
        name, unit = self._header.names[place], self._header.units[place]
        if (fault := self._contents[place].fault) is not None and place not in self._flags:
            where = Where(file=self._reader.text.file, channel=name)
            raise DamagedChannelError(
                fault, "repair or empty the cell, or map another column", where
            )
        column, stamps = self._load_numbers(place), self._stamps[self._header.times[place]]
        present = column.present & stamps.known
        time, values = stamps.seconds, column.values
        if not present.all():
            time, values = time[present], values[present]
        channel = RawChannel(name, unit, time, values, notes=column.notes)
        return channel.select_window(window)

    def _is_channel(self, index: int) -> bool:
        """Return False for time, date, and blank columns of labels or remarks."""
        if index in (*self._header.clocks, *self._header.calendar, self._header.date):
            return False
        name, contents = self._header.names[index], self._contents[index]
        is_empty = not contents.count and not contents.texts
        is_aside = not name or is_remark_name(name) or index < self._header.clocks[0]
        return not (is_empty and is_aside)

    def _find_flags(self, places: Sequence[int]) -> dict[int, dict[str, float]]:
        """Find the columns of texts that are flags, with the number of each text."""
        found = {}
        for index in places:
            contents = self._contents[index]
            if contents.fault is not None and not contents.count:
                states = read_flag(contents.texts)
                if states is not None:
                    found[index] = states
        return found

    def _load_flag(self, place: int) -> Numbers:
        states = self._flags[place]
        table = self._reader.scan((), [place], self._rows)
        cells = list_texts(table, 0, self._reader.text)
        values = np.array([states.get(cell, np.nan) for cell in cells])
        named = ", ".join(f"{text!r} is {value:.0f}" for text, value in states.items())
        return Numbers(values, np.isfinite(values), (f"texts taken as a flag: {named}",))

    def _load_numbers(self, place: int) -> Numbers:
        """Return a column; the sound ones after it are read in the same pass."""
        if place in self._flags:
            return self._load_flag(place)
        if place not in self._kept:
            sound = [one for one in self._places if self._contents[one].fault is None]
            start = sound.index(place)
            many = max(1, _MOST_CELLS // max(1, self._rows))
            wanted = sound if len(sound) <= many else sound[start : start + many]
            self._kept = self._take_numbers(self._reader.scan(wanted, (), self._rows), wanted)
        return self._kept[place]

    def _take_numbers(self, table: ScannedTable, wanted: Sequence[int]) -> dict[int, Numbers]:
        return {one: make_numbers(*table.take_numbers(one), self._contents[one]) for one in wanted}

    def _count_stamps(
        self, time: _TimeColumns, numbers: dict[int, Numbers]
    ) -> tuple[dict[int, _Stamps], tuple[str, ...]]:
        for clock in numbers:
            time.require_numbers(clock, self._contents[clock])
        if len(numbers) == 1:
            return time.count_single(numbers)
        stamps, notices = time.count_several(numbers)
        channels = (index for index in range(len(self._header.names)) if index not in numbers)
        for index in channels:
            known = stamps[self._header.times[index]].known
            if not known.all() and self._contents[index].count:
                column = self._take_numbers(self._reader.scan([index], (), self._rows), [index])
                time.require_stamps(index, ~known & np.isfinite(column[index].values))
        return stamps, notices


class _TimeColumns:
    """Stamps of the time columns of a table whose rows stand on `lines`."""

    def __init__(
        self, header: TableColumns, lines: Sequence[tuple[int, int]], time: TimeColumn, file: str
    ) -> None:
        self._header = header
        self._lines = lines
        self._time = time
        self._file = file

    def parse_texts(self, table: ScannedTable, text: TextFile, dated: bool) -> dict[int, _Stamps]:
        """Stamps from a column of clock times or durations; the day may stand beside them."""
        first = self._header.clocks[0]
        cells, dates = (
            list_texts(table, index, text) if index == 0 or dated else None for index in (0, 1)
        )
        assert cells is not None
        lines = number_lines(self._lines, np.arange(table.rows))
        seconds = parse_time_texts(cells, dates, lines.tolist(), self._place(first))
        return {first: _Stamps(seconds, np.ones(seconds.size, np.bool_))}

    def count_single(
        self, numbers: dict[int, Numbers]
    ) -> tuple[dict[int, _Stamps], tuple[str, ...]]:
        """Stamps from the one time column, and warnings. Raises TimeError for a row without one."""
        ((clock, column),) = numbers.items()
        self.require_stamps(clock, ~column.present)
        if self._header.is_packed_clock and self._time.unit is None:
            counted = unpack_clock(column.values, self._place(clock))
        else:
            counted = column.values * self._get_factor(clock)
        origin = find_origin(counted[:1])
        seconds = subtract_origin(counted, origin)
        return {clock: _Stamps(seconds, column.present)}, describe_origin(origin)

    def count_several(
        self, numbers: dict[int, Numbers]
    ) -> tuple[dict[int, _Stamps], tuple[str, ...]]:
        """Stamps of each of several time columns, from a common origin, and warnings.

        A shorter one ends in blanks or NaN.
        """
        counted = {
            clock: column.values * self._get_factor(clock) for clock, column in numbers.items()
        }
        known = {clock: np.isfinite(stamps) for clock, stamps in counted.items()}
        origin = find_origin(
            float(one) for clock in counted for one in counted[clock][known[clock]][:1]
        )
        named = ", ".join(self._header.names[clock] for clock in self._header.clocks)
        whose = "column of its name" if self._header.is_paired else "columns that follow it"
        note = f"several time columns, each for the {whose}: {named}"
        stamps = {
            clock: _Stamps(subtract_origin(counted[clock], origin), known[clock])
            for clock in counted
        }
        return stamps, (note, *describe_origin(origin))

    def require_numbers(self, clock: int, contents: Contents) -> None:
        """Raise TimeError where a time column holds something else than numbers."""
        if contents.fault is not None:
            remedy = "export time as seconds since the start of the recording"
            if contents.count:
                remedy = f"remove that line if it is a summary or another table, or {remedy}"
            raise TimeError(f"no time stamp: {contents.fault}", remedy, self._place(clock))

    def require_stamps(self, column: int, bare: NDArray[np.bool_]) -> None:
        """Raise TimeError for the first row that is `bare` (n,) of a stamp."""
        if bare.any():
            (line,) = number_lines(self._lines, np.array([int(bare.argmax())]))
            what = f"line {line} has no time stamp"
            raise TimeError(what, "remove the line", self._place(column))

    def _get_factor(self, clock: int) -> float:
        stated = self._time.unit if self._time.unit is not None else self._header.units[clock]
        return get_time_factor(stated, self._place(clock))

    def _place(self, column: int) -> Where:
        return Where(file=self._file, channel=self._header.names[column])


def _has_text(cells: Sequence[str], index: int) -> bool:
    return index < len(cells) and bool(cells[index])
