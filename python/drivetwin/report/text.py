# SPDX-License-Identifier: MIT
"""Blocks as text: in colour on a terminal, else plain."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from io import StringIO
from textwrap import wrap

from rich import box
from rich.console import Console, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from drivetwin._util.escaping_console import EscapingConsole
from drivetwin._util.visible_text import escape_text
from drivetwin.report.blocks import (
    Block,
    Cell,
    FigureBlock,
    NotesBlock,
    TableBlock,
    TextBlock,
    TilesBlock,
    Tone,
    VerdictBlock,
)

_STYLES = {
    Tone.PLAIN: "",
    Tone.GOOD: "green",
    Tone.DOUBTFUL: "yellow",
    Tone.BAD: "red",
    Tone.UNKNOWN: "dim",
}
_WIDTH = 80
"""Width of a text that is not for a terminal."""
_HEAD = 11
"""Width up to which the head of a column of numbers is not broken."""
_WIDEST = 1000
"""Width at which every table fits."""


def format_blocks(blocks: Iterable[Block], width: int = _WIDTH) -> str:
    """Return blocks as plain text; figures are left out."""
    text = StringIO()
    print_blocks(
        EscapingConsole(
            file=text, width=width, color_system=None, highlight=False, markup=False, emoji=False
        ),
        blocks,
    )
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines()).strip("\n")


def print_blocks(console: Console, blocks: Iterable[Block]) -> None:
    """Print blocks, an empty line after each; figures are left out."""
    for block in blocks:
        for part in _render_block(console, block):
            console.print(part)


def _render_block(console: Console, block: Block) -> Iterator[RenderableType]:
    match block:
        case FigureBlock():
            return
        case VerdictBlock():
            yield Text(f"Model: {block.status}", style=f"bold {_STYLES[block.tone]}")
            yield _indent(block.reason)
            yield _indent(block.action)
        case TableBlock():
            if block.caption:
                yield Text(block.caption, style="italic")
            yield _render_table(console, block)
            return
        case NotesBlock():
            yield Text(block.heading, style=f"bold {_STYLES[block.tone]}")
            for item in block.items:
                yield _indent(item)
        case TilesBlock():
            for one in block.tiles:
                value = f"{one.value} ({one.note})" if one.note else one.value
                yield Text.assemble(f"{one.label}: ", (value, _STYLES[one.tone]))
        case TextBlock():
            yield Text(block.text)
    yield ""


def _indent(text: str) -> RenderableType:
    return Padding(Text(text), (0, 0, 0, 2))


def _render_table(console: Console, block: TableBlock) -> Table:
    """Render a table, without its secondary columns where these do not fit."""
    whole = _fill_table(block.head, block.rows)
    room = console.options.update(max_width=_WIDEST)
    if console.measure(whole, options=room).maximum <= console.width:
        return whole
    kept = [k for k, head in enumerate(block.head) if not head.secondary]
    return _fill_table(
        [block.head[k] for k in kept], [[row[k] for k in kept] for row in block.rows]
    )


def _fill_table(head: Sequence[Cell], rows: Sequence[Sequence[Cell]]) -> Table:
    """Fill a table in the one style; texts are folded, a number stays whole as long as it can."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
    for place, one in enumerate(head):
        width = max((len(text) for row in rows for text in row[place].texts), default=0)
        table.add_column(
            _render_head(one, width),
            justify="right" if one.number else "left",
            no_wrap=one.number,
            overflow="fold",
        )
    for row in rows:
        table.add_row(*map(_render_cell, row))
    return table


def _render_head(head: Cell, width: int) -> Text:
    """Render a head; that of numbers is broken at words so that it is hardly wider than they."""
    texts = [escape_text(one) for one in head.texts]
    if head.number:
        words = [word for text in texts for word in text.split()]
        width = max([width, _HEAD, *map(len, words)])
        texts = [line for text in texts for line in wrap(text, width)]
    return Text("\n".join(texts))


def _render_cell(cell: Cell) -> Text:
    """Render a cell: its text, and smaller texts below it."""
    style = _STYLES[cell.tone] if cell.badge else ""
    return Text("\n").join(
        Text(escape_text(text), style=style if text is cell.text else "dim") for text in cell.texts
    )
