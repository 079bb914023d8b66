# SPDX-License-Identifier: MIT
"""One pass over the rows of a text table, in blocks; the checks of its form."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drivetwin._native import ScannedTable, TableScanner
from drivetwin.channels.names import is_time_name, split_name_and_unit
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.formats.cell_text import (
    Meaning,
    check_decimal_signs,
    classify_text,
    describe_text,
    is_number,
)
from drivetwin.logs.formats.table_head import (
    BLANKS,
    EXPORT,
    TableHead,
    TextFile,
    make_binary_error,
    make_width_error,
    split_line,
)

_NUMBER, _BLANK, FIRST_TEXT, OTHER_TEXT = 0, 1, 2, 255
"""Kinds of cells: a number, nothing, the first of the texts, a text beyond those kept."""


@dataclass(frozen=True)
class Contents:
    """Cells of a column without its numbers.

    `count` is the number of numbers, `texts` are the different texts in the order of their kinds;
    `fault` names the first that is neither a sign nor a word for "no number".
    """

    count: int
    texts: Sequence[str]
    fault: str | None


@dataclass(frozen=True, eq=False)
class Numbers:
    """A column as numbers: `values` (n,) where `present` (n,); NaN where the file contains one.

    `notes` describe the cells that are no samples although they are not blank.
    """

    values: FloatArray
    present: NDArray[np.bool_]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class TableReader:
    """Layout of a table of `width` columns, of which `time` is the first with stamps."""

    text: TextFile
    head: TableHead
    width: int
    time: int
    time_is_text: bool

    def scan(self, numbers: Sequence[int], texts: Sequence[int], rows: int = 0) -> ScannedTable:
        """Read the columns `numbers` as numbers and `texts` as texts; about `rows` are expected."""
        separator = self.head.separator
        lines = (*self.head.above, self.head.names, *self.head.below, *self.head.between)
        labels = {line.cells[0] for line in lines if re.match(r"[^\W\d]|[\[*]", line.cells[0])}
        scanner = TableScanner(
            separator=None if separator == BLANKS else ord(separator),
            width=self.width,
            least=self.width - self.head.has_remarks,
            time=self.time,
            time_is_text=self.time_is_text,
            skip=self.head.first - 1,
            labels=[label.encode() for label in labels],
            numbers=numbers,
            texts=texts,
            rows=rows,
        )
        for block in self.text.iterate_blocks():
            scanner.feed(block)
        return scanner.finish()

    def check(self, table: ScannedTable) -> list[str]:
        """Refuse a damaged table; return what was left out of a sound one.

        Raises FileFormatError for bytes that are no text, quotes that do not close, lines with too
        few or too many fields, a second table, and open decimal signs.
        """
        file = self.text.file
        if table.binary is not None:
            raise make_binary_error(table.binary, file)
        if table.quote is not None:
            line, fault = table.quote
            what = f"line {line}: a quoted field does not end where it should ({fault})"
            raise FileFormatError(what, EXPORT, Where(file=file))
        notes = [*self._describe_head(), *self._describe_remarks(table), *self._check_widths(table)]
        if not table.rows:
            what = "the file holds names but no samples"
            raise FileFormatError(what, EXPORT, Where(file=file))
        check_decimal_signs(table.decimals, file)
        return notes

    def _describe_head(self) -> list[str]:
        notes = []
        if above := self.head.above:
            shown = _show_lines(len(above), above[0].text)
            notes.append(f"{shown[0]} above the names left out{shown[1]}")
        if between := self.head.between:
            shown = _show_lines(len(between), between[0].text)
            notes.append(f"{shown[0]} between the names and the rows left out{shown[1]}")
        return notes

    def _describe_remarks(self, table: ScannedTable) -> list[str]:
        """Describe the lines between the rows; refuse those that begin another table."""
        if not table.remark_count:
            return []
        names = [cell for cell in self.head.names.cells if cell]
        for text, line in table.remarks:
            cells = [
                cell for cell in split_line(self.text.decode(text), self.head.separator) if cell
            ]
            timed = any(is_time_name(split_name_and_unit(cell)[0]) for cell in cells)
            others = len(cells) > 1 and not any(map(is_number, cells))
            if timed and others and cells != names and len(cells) == len(names):
                raise FileFormatError(
                    f"line {line} begins another table, with other names",
                    "export one table, or cut the file there",
                    Where(file=self.text.file),
                )
        text, line = table.remarks[0]
        shown = _show_lines(table.remark_count, self.text.decode(text))
        return [f"{shown[0]} between the rows left out{shown[1]} in line {line}"]

    def _check_widths(self, table: ScannedTable) -> list[str]:
        """Describe a cut last line; refuse other lines of another width."""
        if table.ragged is None:
            return []
        line, count = table.ragged
        cut = count < self.width and line == table.last_line and table.rows > 0
        if table.ragged_count > 1 or not cut:
            separator, file = self.head.separator, self.text.file
            raise make_width_error(line, count, self.width, separator, file)
        text = f"line {line}, the last, has {count} of {self.width} fields and is left out"
        return [f"the file is cut: {text}"]


def _show_lines(count: int, first: str) -> tuple[str, str]:
    """Words for a number of lines, and for the first of them."""
    shown = repr(first.strip()[:60])
    return ("1 line", f": {shown}") if count == 1 else (f"{count} lines", f", the first {shown}")


def list_contents(table: ScannedTable, text: TextFile) -> list[Contents]:
    """Return the contents of each column."""
    found = []
    for count, texts in table.contents:
        cells = [text.decode(cell) for cell, _ in texts]
        faults = (
            describe_text(cell, line)
            for cell, (_, line) in zip(cells, texts, strict=True)
            if classify_text(cell) is Meaning.TEXT
        )
        found.append(Contents(count, cells, next(faults, None)))
    return found


def make_numbers(values: FloatArray, kinds: NDArray[np.uint8], contents: Contents) -> Numbers:
    """Return a column as numbers.

    Words for no number are samples without one, but in a column whose numbers come every few rows
    only, as where a table joins channels of several rates: there they fill the rows between.
    """
    if not kinds.size:
        return Numbers(values, np.ones(values.size, np.bool_))
    is_absent = np.zeros(OTHER_TEXT + 1, np.bool_)
    meanings = {
        FIRST_TEXT + index: classify_text(text) for index, text in enumerate(contents.texts)
    }
    is_absent[[kind for kind, meaning in meanings.items() if meaning is Meaning.ABSENT]] = True
    words = [kind for kind, meaning in meanings.items() if meaning is Meaning.NO_NUMBER]
    if words and contents.count > 1 and np.isin(kinds, words).sum() > contents.count:
        apart = np.diff(np.flatnonzero(kinds == _NUMBER))
        is_absent[words] = float(np.median(apart)) > 1.0
    notes: tuple[str, ...] = ()
    if left := int(is_absent[kinds].sum()):
        signs = ", ".join(repr(text) for index, text in enumerate(contents.texts)
                          if is_absent[FIRST_TEXT + index])  # fmt: skip
        notes = (f"{left} cells hold {signs} for no sample",)
    is_absent[_BLANK] = True
    return Numbers(values, ~is_absent[kinds], notes)


def number_lines(lines: Sequence[tuple[int, int]], rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the lines of the file on which `rows` (n,) stand; see `ScannedTable.lines`."""
    starts, numbers = np.array(lines, np.intp).T
    run = np.searchsorted(starts, rows, side="right") - 1
    return np.asarray(numbers[run] + rows - starts[run])


def list_texts(table: ScannedTable, index: int, text: TextFile) -> list[str]:
    """Return the cells of the column at `index` of those scanned as texts."""
    joined, ends = table.take_texts(index)
    bounds = [0, *ends.tolist()]
    if joined.isascii():
        cells = joined.decode("ascii")
        return [cells[a:b] for a, b in pairwise(bounds)]
    return [text.decode(joined[a:b]) for a, b in pairwise(bounds)]
