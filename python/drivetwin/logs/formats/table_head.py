# SPDX-License-Identifier: MIT
"""Opening of a text table, and its head: separator, line of the names, first line of the rows.

Programs write what they like above the names: titles, sections, rows of channel numbers, a first
table of settings. The rows are the first three lines in a row that start with a number or a time
and have the usual width; the names are the fullest line with a name for time above them.
"""

from __future__ import annotations

import codecs
import contextlib
import csv
import os
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import BinaryIO

from drivetwin._util.text import restore_cell
from drivetwin.channels.names import is_time_name, split_name_and_unit
from drivetwin.channels.roles import TimeColumn
from drivetwin.channels.units import find_unit, is_unit
from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.formats.cell_text import Meaning, classify_text, is_number, is_time_text

_BLOCK = 1 << 22
"""Bytes that are read at a time."""

_HEAD = 1 << 16
"""Bytes of the head that are read at a time."""

_HEAD_LINES, _LONGEST_HEAD = 1000, 1 << 23
"""Lines of the head, and bytes in which they must lie."""

EXPORT = "export the log as text: one row of names, one of units, then one row for each sample"
_NO_TEXT = re.compile(rb"[\x00-\x08\x0e-\x1f]")

_WIDE = {codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
_LEAST_ZEROS = 0.8
"""Least share of zeros among the high bytes of Western text in UTF-16."""


@dataclass(frozen=True)
class TextFile:
    """An open text file. `wide` is its encoding where that has two bytes for each sign."""

    source: BinaryIO
    wide: str | None
    file: str

    def iterate_blocks(self, size: int = _BLOCK) -> Iterator[bytes]:
        """Yield the whole file, in UTF-8 or with one byte for each sign."""
        self.source.seek(0)
        decoder = codecs.getincrementaldecoder(self.wide)(errors="replace") if self.wide else None
        while block := self.source.read(size):
            yield decoder.decode(block).encode("utf-8", "replace") if decoder else block

    def estimate_lines(self, some: Sequence[str]) -> int:
        """Estimate from `some` lines how many the file has, with a margin."""
        size = self.source.seek(0, os.SEEK_END) // (2 if self.wide else 1)
        length = sum(len(line) + 1 for line in some) / max(1, len(some))
        return int(1.02 * size / max(2.0, length)) + 1

    def decode(self, text: bytes) -> str:
        """Text of bytes; cp1252 where they are no UTF-8, as older tools write ° and µ."""
        try:
            return text.decode("utf-8-sig")
        except UnicodeDecodeError:
            return text.decode("cp1252", errors="replace")

    def read_head(self) -> list[str]:
        """Return the first lines."""
        read, ends = bytearray(), 0
        for block in self.iterate_blocks(_HEAD):
            read += block
            ends += max(block.count(b"\n"), block.count(b"\r"))
            if ends >= _HEAD_LINES or len(read) > _LONGEST_HEAD:
                del read[max(read.rfind(b"\n"), read.rfind(b"\r")) + 1 or len(read) :]
                break
        head = bytes(read)
        if match := _NO_TEXT.search(head):
            raise make_binary_error(match.start(), self.file)
        lines = head.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n", _HEAD_LINES)
        if not any(map(bytes.strip, lines)):
            where = Where(file=self.file)
            raise FileFormatError("the file is empty", "record or export the log again", where)
        return self.decode(b"\n".join(lines[:_HEAD_LINES])).split("\n")


def make_binary_error(place: int, file: str) -> FileFormatError:
    """Return the error for a byte that is no text."""
    what = f"the file is binary or damaged: byte {place} is no text"
    return FileFormatError(what, EXPORT, Where(file=file))


def open_text(source: BinaryIO, file: str) -> TextFile:
    """Return the text file in `source`, which can be read again from its start."""
    head = source.read(4096)
    return TextFile(source, _WIDE.get(head[:2]) or _detect_wide(head), file)


def _detect_wide(head: bytes) -> str | None:
    """Return the encoding of a text with two bytes for each sign and without a mark."""
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) or len(head) < 16:
        return None
    even, odd = head[::2].count(0), head[1::2].count(0)
    if max(even, odd) < _LEAST_ZEROS * (len(head) // 2) or min(even, odd) > 0:
        return None
    return "utf-16-be" if even else "utf-16-le"


COMMENT_MARKS = ("#", "%", "//")
BLANKS = " "
"""Stands for any number of blanks; every text has some, so it counts only before numbers."""

_SEPARATORS = ("\t", ";", ",", "|", BLANKS)
"""In the order tried."""

_HANDICAP = 0.2
"""Share of sound cells by which blanks must be the better separator: they stand in texts, too."""

_LOOKED_AT = 200
"""Number of lines used to detect separator and width of the table, unless none is a row."""

_SURE_RUN = 3
"""So many rows of numbers, one after the other, are the table."""

_MOST_BELOW = 3
"""Rows of units, comments and types at most."""

_DATE = re.compile(r"\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2}[-/.]\d{1,2}[-/.]\d{2,4}", re.ASCII)

_REMARK_NAME = re.compile(
    r"(comment|remark|note|annotation|marker|event|kommentar|bemerkung)s?|ap info\b.*",
    re.IGNORECASE,
)
"""Name of a last column that rows may leave out."""


@dataclass(frozen=True)
class Line:
    """A line that is no comment: `number` from 1, and its fields."""

    number: int
    text: str
    cells: Sequence[str]


@dataclass(frozen=True)
class TableHead:
    """Lines up to the first row: those `above` the names, the names, and those `below`.

    Below stand units, comments or types; lines of another format are those `between`.

    `first` is the number of the line of the first row that has numbers or would have; `rows` are
    the first rows.
    """

    separator: str
    above: Sequence[Line]
    names: Line
    below: Sequence[Line]
    between: Sequence[Line]
    rows: Sequence[Line]
    first: int

    @property
    def has_remarks(self) -> bool:
        """The last column holds remarks, which rows may leave out."""
        return is_remark_name(self.names.cells[-1])


def is_remark_name(cell: str) -> bool:
    """Return True for the name of a column of remarks."""
    return _REMARK_NAME.fullmatch(cell.strip()) is not None


def find_table_head(lines: Sequence[str], time: TimeColumn, file: str) -> TableHead:
    """Find the head among the first lines of a file.

    Raises FileFormatError where no separator splits the lines into columns.
    """
    separators: Sequence[str] = _SEPARATORS
    if stated := re.fullmatch(r'"?sep=(.)"?\s*', lines[0]):
        separators = (stated[1],)
        lines = ["", *lines[1:]]
    kept = [
        (number, line)
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.lstrip().startswith(COMMENT_MARKS)
    ]
    if not kept:
        raise FileFormatError("the file holds only comments", EXPORT, Where(file=file))
    first = kept[:_LOOKED_AT]
    for lines_of, lenient in ((first, False), (kept, False), (first, True)):
        tables = _split_lines(lines_of, separators, lenient)
        if any(table.has_rows for table in tables):
            break
    found = max(
        (table for table in tables if table.has_rows), key=lambda table: table.fitness, default=None
    ) or next(
        (one for one in tables if one.separator != BLANKS and max(map(len, one.cells)) > 1), None
    )
    if found is None:
        raise FileFormatError(
            f"no columns found: no tab, semicolon, comma, bar or blank splits {kept[0][1][:60]!r} "
            "and the lines below alike",
            EXPORT,
            Where(file=file),
        )
    return found.make_head(lines, time, file)


def _split_lines(
    kept: Sequence[tuple[int, str]], separators: Sequence[str], lenient: bool
) -> list[_TableLines]:
    """Split the lines by each of the separators."""
    return [
        _TableLines(
            [Line(number, text, split_line(text, sign)) for number, text in kept], sign, lenient
        )
        for sign in separators
    ]


def split_strictly(line: str, separator: str) -> list[str]:
    """Fields of one line; raises csv.Error where a quote does not close on it."""
    if separator == BLANKS:
        return line.split()
    if '"' not in line:
        return line.split(separator)
    return next(csv.reader([line], delimiter=separator, skipinitialspace=True, strict=True))


def split_line(line: str, separator: str) -> list[str]:
    """Fields of a line without blanks around them; quotes that do not close are text."""
    fields = line.split(separator)
    with contextlib.suppress(csv.Error):
        fields = split_strictly(line, separator)
    cells = map(str.strip, fields)
    return [*map(restore_cell, cells)] if "'" in line else [*cells]


def is_value(cell: str) -> bool:
    """Return True for a number or a time."""
    return is_number(cell) or is_time_text(cell) or _DATE.fullmatch(cell) is not None


def is_physical_unit(cell: str) -> bool:
    """Return True if a cell is a unit other than that of a dimensionless number."""
    return is_unit(cell) and find_unit(cell) != find_unit("-")


def _is_row(cells: Sequence[str]) -> bool:
    """Return True if a line has several fields, and the first that is not blank holds a value."""
    return len(cells) > 1 and is_value(next(filter(None, cells), ""))


def make_width_error(
    line: int, count: int, width: int, separator: str, file: str
) -> FileFormatError:
    """Return the error for a line with `count` fields below `width` names."""
    what, remedy = f"line {line} has {count} fields, the names have {width}", EXPORT
    if separator == "," and width < count <= 2 * width:
        what += ": the comma separates the columns and seems to be the decimal sign as well"
        remedy = "export with a semicolon or tab between the columns, or with a decimal point"
    return FileFormatError(what, remedy, Where(file=file))


class _TableLines:
    """The first lines of a file, split by one separator.

    `lenient`: a line is a row if half of its fields hold values, as where a column of texts comes
    first.
    """

    def __init__(self, lines: Sequence[Line], separator: str, lenient: bool) -> None:
        self.lines = lines
        self.separator = separator
        self.cells = [line.cells for line in lines]
        rows = list(map(_is_row, self.cells))
        if lenient and separator != BLANKS:
            rows = [
                len(cells) > 1 and 2 * sum(map(is_value, cells)) >= len(cells)
                for cells in self.cells
            ]
        self.has_rows = any(rows)
        widths = [len(cells) for cells, is_row in zip(self.cells, rows, strict=True) if is_row]
        counts = Counter(widths or map(len, self.cells))
        self.width = max(counts.items(), key=lambda item: (item[1], item[0]))[0]
        usual = [cells for cells in self.cells if len(cells) == self.width]
        self.last_empty = all(not cells[-1] for cells in usual)
        self.first = self._find_first_row(rows)
        values = [cell for cells, is_row in zip(self.cells, rows, strict=True) if is_row
                  for cell in cells]  # fmt: skip
        sound = sum(is_value(cell) or classify_text(cell) is not Meaning.TEXT for cell in values)
        self.fitness = sound / max(1, len(values)) - _HANDICAP * (separator == BLANKS)
        """Share of the cells of rows that are no text."""

    def _find_first_row(self, rows: Sequence[bool]) -> int:
        """Index of the first of three rows in a row, else of the longest run of rows."""
        fits = [is_row and len(cells) == self.width for is_row, cells in
                zip(rows, self.cells, strict=True)]  # fmt: skip
        runs = []
        for fit, group in groupby(range(len(fits)), key=fits.__getitem__):
            members = list(group)
            if fit:
                runs.append((members[0], len(members)))
        longest = max((length for _, length in runs), default=0)
        sure = (start for start, length in runs if length >= min(_SURE_RUN, longest))
        return next(sure, len(rows))

    def make_head(self, lines: Sequence[str], time: TimeColumn, file: str) -> TableHead:
        """Return the head; see `find_table_head`."""
        start = self._find_names(time)
        if start is None:
            named = self._find_commented_names(lines)
            if not named:
                self._refuse_commas(file)
                raise FileFormatError(
                    f"line {self.lines[0].number} holds numbers in place of names",
                    EXPORT,
                    Where(file=file),
                )
            first, *below = named
            return TableHead(self.separator, (), first, below, (), self.lines, self.lines[0].number)
        self._refuse_table_above(start, file)
        below, end = self._find_lines_below(start, time)
        last = self.lines[-1].number + 1
        first_row = self.lines[end].number if end < len(self.lines) else last
        return TableHead(
            self.separator,
            self.lines[:start],
            self.lines[start],
            below,
            [line for line in self.lines[start + 1 : end] if line not in below],
            self.lines[end:],
            first_row,
        )

    def _refuse_commas(self, file: str) -> None:
        """Raise FileFormatError where rows have more fields than names, two for each at most."""
        above = (one for one in reversed(self.cells[: self.first]) if len(one) > 1)
        names = next((one for one in above if not any(map(is_value, one))), ())
        if self.first < len(self.lines) and len(names) < self.width <= 2 * len(names):
            number = self.lines[self.first].number
            raise make_width_error(number, self.width, len(names), self.separator, file)

    def _can_be_names(self, cells: Sequence[str]) -> bool:
        """Return True if a line has the usual width, but for a separator or remarks at its end."""
        longer = len(cells) == self.width + 1 and (not cells[-1] or is_remark_name(cells[-1]))
        shorter = len(cells) == self.width - 1 and self.last_empty
        return len(cells) > 1 and (len(cells) == self.width or longer or shorter)

    def _find_names(self, time: TimeColumn) -> int | None:
        """Index of the names: the fullest line with a name for time, else the first.

        Lines of the usual width right above the rows come before others; rows of numbers and rows
        of units are none.
        """
        above = self.cells[: self.first]
        may = [index for index, cells in enumerate(above) if self._can_be_names(cells)]
        worded = [one for one in may if not any(map(is_value, filter(None, above[one])))]
        may = worded or [one for one in may if not all(map(is_value, filter(None, above[one])))]
        may = [one for one in may if not _is_units_row(above[one])]
        end = self.first
        while end > 0 and not self._can_be_names(above[end - 1]):
            end -= 1
        begin = end
        while begin > 0 and self._can_be_names(above[begin - 1]):
            begin -= 1
        block = [one for one in may if begin <= one < end]
        for some in (block, may):
            timed = [one for one in some if _has_time_name(above[one], time)]
            if timed:
                return max(timed, key=lambda index: _count_cells(above[index]))
        return next(iter(block or may), None)

    def _refuse_table_above(self, start: int, file: str) -> None:
        """Refuse rows of numbers above the names, but a single one, as of channel numbers."""
        for one, after in zip(self.lines[: max(0, start - 1)], self.lines[1:], strict=False):
            if all(cells and all(map(is_number, cells)) for cells in (one.cells, after.cells)):
                raise FileFormatError(
                    f"lines {one.number} and {after.number} hold rows of numbers above the names "
                    f"in line {self.lines[start].number}",
                    EXPORT,
                    Where(file=file),
                )

    def _find_lines_below(self, start: int, time: TimeColumn) -> tuple[list[Line], int]:
        """Lines of units, comments or types below the names, and the index of the first row.

        Of units only the first may hold numbers: that of a fraction, `1`, but not for time.
        """
        times = [index for index, cell in enumerate(self.cells[start])
                 if _has_time_name([cell], time)]  # fmt: skip
        labelled = all(not cells[0] for cells in self.cells[self.first :] if cells)
        below: list[Line] = []
        for end in range(start + 1, len(self.lines)):
            cells = self.cells[end]
            if end >= self.first and not self._can_be_names(cells):
                return below, end
            is_label = labelled and bool(cells[0]) and end < self.first
            stamps = [cells[index] for index in times if index < len(cells)]
            looked_at = cells if below else [*stamps, *(c for c in cells if not is_unit(c))]
            if any(map(is_value, looked_at)):
                if not is_label and self._can_be_names(cells):
                    return below, end
            elif len(below) == _MOST_BELOW:
                return below, end
            elif self._can_be_names(cells):
                below.append(self.lines[end])
        return below, len(self.lines)

    def _find_commented_names(self, lines: Sequence[str]) -> list[Line]:
        """Comment lines with names, and units if present, above a table without a header.

        They split into as many fields as the first row; units are detected by their spelling.
        """
        found: list[Line] = []
        width = len(self.cells[0])
        for number, line in enumerate(lines[: self.lines[0].number - 1], start=1):
            text = re.sub(r"^\s*(#|%|//)+\s*", "", line)
            cells = split_line(text, self.separator)
            if len(cells) == width and not any(map(is_number, cells)):
                found.append(Line(number, text, cells))
        if found and all(is_unit(cell) or not cell for cell in found[-1].cells):
            return found[-2:]
        return found[-1:]


def _is_units_row(cells: Sequence[str]) -> bool:
    """Return True if all cells are units or blank, with a physical one among them."""
    return all(not cell or is_unit(cell) for cell in cells) and any(map(is_physical_unit, cells))


def _has_time_name(cells: Sequence[str], time: TimeColumn) -> bool:
    """Return True if one of the cells is a name for time."""
    names = (split_name_and_unit(cell)[0] for cell in cells)
    return any(is_time_name(name) if time.source is None else name == time.source for name in names)


def _count_cells(cells: Sequence[str]) -> int:
    """Fields up to the last that is not blank."""
    return max((index for index, cell in enumerate(cells, start=1) if cell), default=0)
