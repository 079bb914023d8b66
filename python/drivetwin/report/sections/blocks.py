# SPDX-License-Identifier: MIT
"""The few things a report page is made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from drivetwin.report.figure import Figure
from drivetwin.report.figures.stack import Panel
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
    """Left out on paper, where the page is narrow."""
    remark: str = ""
    """Limitation of the row, shown below the note."""
    href: str = ""
    """Page that the text leads to."""


@dataclass(frozen=True, eq=False)
class FigureBlock:
    """A figure with its caption.

    Of a figure over time `panels` hold all samples, in the order of its first traces; the page
    draws from them. `link` names the figures that zoom together.
    """

    figure: Figure
    caption: str
    panels: Sequence[Panel] = ()
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
    """Verdict on a model in a coloured box: status, reason and next action."""

    status: str
    reason: str
    action: str
    tone: Tone
    kind: str = field(default="verdict", init=False)


Block = VerdictBlock | FigureBlock | TableBlock | NotesBlock | TilesBlock


@dataclass(frozen=True, eq=False)
class Section:
    """A titled part of the report; `anchor` is its address in the page.

    `collapsed` sections are closed until the reader opens them, and are not printed.
    """

    anchor: str
    title: str
    intro: str
    blocks: Sequence[Block]
    collapsed: bool = False

    @property
    def short(self) -> bool:
        """True if the section has no figure over time and may share a printed page."""
        return not any(isinstance(one, FigureBlock) for one in self.blocks)


def make_link(shift: Shift) -> str:
    """The `link` of all figures of one shift."""
    return f"{shift.start_gear}→{shift.end_gear} at {shift.lockup_time:z.3f} s"


def make_cells(*texts: str, number: bool = False) -> tuple[Cell, ...]:
    """Plain cells of one row."""
    return tuple(Cell(text, number=number) for text in texts)
