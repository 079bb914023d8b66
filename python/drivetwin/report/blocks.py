# SPDX-License-Identifier: MIT
"""Blocks: the few things of which a result consists on page, screen, terminal and in a notebook.

A result is converted to blocks once; each medium renders blocks and knows no type of result.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drivetwin._util.display_units import format_significant
from drivetwin.errors import DrivetwinError
from drivetwin.findings import Finding, Severity, render

if TYPE_CHECKING:
    from drivetwin.report.figure import Figure
    from drivetwin.shifts.shift import Shift


class Tone(StrEnum):
    """Colour class of a cell, tile or note."""

    PLAIN = "plain"
    GOOD = "good"
    DOUBTFUL = "doubtful"
    BAD = "bad"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class Cell:
    """One table cell; `number` cells are right-aligned, `badge` cells drawn as a coloured label."""

    text: str
    number: bool = False
    badge: bool = False
    tone: Tone = Tone.PLAIN
    note: str = ""
    """Smaller text under the cell's own."""
    secondary: bool = False
    """Left out where there is little room: on paper, in a narrow terminal."""
    remark: str = ""
    """Limitation of the row, shown below the note."""
    href: str = ""
    """Page that the text leads to."""

    @property
    def texts(self) -> tuple[str, ...]:
        """The text, and what stands below it."""
        return tuple(one for one in (self.text, self.note, self.remark) if one)


@dataclass(frozen=True, eq=False)
class FigureBlock:
    """A figure with its caption; `link` names the figures that zoom together."""

    figure: Figure
    caption: str
    link: str = ""
    kind: str = field(default="figure", init=False)


@dataclass(frozen=True)
class TableBlock:
    """A table with its caption."""

    caption: str
    head: Sequence[Cell]
    rows: Sequence[Sequence[Cell]]
    kind: str = field(default="table", init=False)


@dataclass(frozen=True)
class NotesBlock:
    """A list of sentences under a heading."""

    heading: str
    items: Sequence[str]
    tone: Tone = Tone.PLAIN
    kind: str = field(default="notes", init=False)


@dataclass(frozen=True)
class Tile:
    """One figure of merit on the first page."""

    label: str
    value: str
    tone: Tone = Tone.PLAIN
    note: str = ""


@dataclass(frozen=True)
class TilesBlock:
    """Figures of merit side by side."""

    tiles: Sequence[Tile]
    kind: str = field(default="tiles", init=False)


@dataclass(frozen=True)
class VerdictBlock:
    """Verdict on a result in a coloured box: status, reason and next action."""

    status: str
    reason: str
    action: str
    tone: Tone
    subject: str = "Model"
    kind: str = field(default="verdict", init=False)


@dataclass(frozen=True)
class TextBlock:
    """A paragraph."""

    text: str
    kind: str = field(default="text", init=False)


Block = VerdictBlock | FigureBlock | TableBlock | NotesBlock | TilesBlock | TextBlock
Column = str | tuple[str, str] | tuple[str, str, str] | Cell
"""Head of a column of texts; of one of numbers with their format and perhaps a note; or a cell."""


@dataclass(frozen=True, eq=False)
class Section:
    """A titled part of the report; `anchor` is its address in the page."""

    anchor: str
    title: str
    intro: str
    blocks: Sequence[Block]

    @property
    def short(self) -> bool:
        """True if the section has no figure over time and may share a printed page."""
        return not any(isinstance(one, FigureBlock) for one in self.blocks)


@dataclass(frozen=True, eq=False)
class Page:
    """Page of a result; sections without blocks are not shown."""

    title: str
    subtitle: str
    sections: Sequence[Section]


def make_link(shift: Shift) -> str:
    """The `link` of all figures of one shift."""
    return f"{shift.name} at {shift.lockup_time:z.3f} s"


def make_notes(heading: str, items: Iterable[str], tone: Tone = Tone.PLAIN) -> list[Block]:
    """Make the list of sentences under a heading; nothing without sentences."""
    listed = list(items)
    return [NotesBlock(heading, listed, tone)] if listed else []


def make_table(
    caption: str, columns: Sequence[Column], rows: Iterable[Iterable[object]]
) -> TableBlock:
    """Build a table from values.

    Parameters
    ----------
    caption : text above the table
    columns : heads; with a format, as in `("slip [rad/s]", ".1f")` or with the number of
        significant digits in `("work [kJ]", "3")`, the column holds numbers; a third text is the
        note of the head.
    rows : one value for each column: a text, a number, a cell with more than that, or None, which
        is a dash

    Returns
    -------
    TableBlock
    """
    heads, formats = zip(*map(_split_column, columns), strict=True) if columns else ((), ())
    cells = [
        tuple(_make_cell(*one) for one in zip(row, heads, formats, strict=True)) for row in rows
    ]
    return TableBlock(caption, heads, cells)


def make_tables(
    caption: str, columns: Sequence[Column], rows: Iterable[Iterable[object]]
) -> list[Block]:
    """Build a table as `make_table`; nothing without rows."""
    table = make_table(caption, columns, rows)
    return [table] if table.rows else []


def _split_column(column: Column) -> tuple[Cell, str]:
    if isinstance(column, Cell):
        return column, ""
    text, spec, *note = (column, "") if isinstance(column, str) else column
    return Cell(text, number=bool(spec), note="".join(note)), spec


def _make_cell(value: object, head: Cell, spec: str) -> Cell:
    """Make a cell in the column of `head` from a value, a number by its format."""
    if isinstance(value, Cell):
        return replace(value, secondary=value.secondary or head.secondary)
    if value is None:
        text = "–"
    elif isinstance(value, str):
        text = value
    elif isinstance(value, int | float) and spec.isdecimal():
        text = format_significant(value, int(spec))
    else:
        text = format(value, spec)
        if text.startswith("-") and not text.strip("-0."):  # a negative zero loses its sign
            text = text.replace("-", "+" if spec.startswith("+") else "")
    return Cell(text, number=head.number, secondary=head.secondary)


def make_number(text: str, note: str = "", *, secondary: bool = False) -> Cell:
    """Make the cell of a formatted number, or the head of a column of numbers."""
    return Cell(text, number=True, note=note, secondary=secondary)


def make_badge(text: str, tone: Tone, note: str = "") -> Cell:
    """Make the cell of a verdict, drawn as a coloured label."""
    return Cell(text, badge=True, tone=tone, note=note)


_SEVERITIES = (
    (Severity.ERROR, "Errors", Tone.BAD),
    (Severity.WARNING, "Warnings", Tone.DOUBTFUL),
    (Severity.INFO, "Information", Tone.PLAIN),
)


def build_findings_section(findings: Sequence[Finding]) -> Section:
    """Findings by severity, errors first, each group with the tables of its findings."""
    blocks: list[Block] = []
    for severity, heading, tone in _SEVERITIES:
        alike = [one for one in findings if one.severity is severity]
        blocks += make_notes(heading, render(alike), tone)
        blocks += [make_table(one.cause, one.heads, one.cells) for one in alike if one.rows]
    intro = "Remarks on log, vehicle card and fit, with cause and remedy."
    return Section("findings", "Findings", intro, blocks)


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of a command.

    `blocks` are for people, `lines` below them are never wrapped; `document` is for programs;
    `files` were written. `is_confirmed` is false for a result that a strict run refuses. `fault` is
    the error of a part, beside which the rest was done. `is_json` is true where the document is the
    result for people too. `exit_code` is that of a complete result, such as of a failed test.
    """

    blocks: Sequence[Block] = ()
    document: Mapping[str, Any] | None = None
    files: Sequence[Path] = ()
    is_confirmed: bool = True
    fault: DrivetwinError | None = None
    lines: Sequence[str] = ()
    is_json: bool = False
    exit_code: int = 0
