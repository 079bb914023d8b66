# SPDX-License-Identifier: MIT
"""Blocks as text, in colour on a terminal, else plain; a console that escapes what it is given."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from io import StringIO
from itertools import accumulate
from typing import Any

from rich import box
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType
from rich.padding import Padding
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from drivetwin._util.text import escape_text
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


class EscapingConsole(Console):
    """Console whose texts contain no control characters; its own colours and lines remain."""

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Render, with the text of each segment escaped."""
        for text, style, control in super().render(renderable, options):
            is_plain = control or text.isprintable()
            yield Segment(text if is_plain else escape_text(text), style, control)

    def render_str(self, text: str, **options: Any) -> Any:
        """Convert a plain text; escaped here because a text drops some control characters."""
        return super().render_str(escape_text(text), **options)


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
_BESIDE = 2
"""Space between the texts of two columns."""


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
            yield Text(f"{block.subject}: {block.status}", style=f"bold {_STYLES[block.tone]}")
            yield _indent(block.reason)
            yield _indent(block.action)
        case TableBlock():
            if block.caption:
                yield Text(block.caption, style="italic")
            yield from _render_tables(block, console.width)
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


def _render_tables(block: TableBlock, width: int) -> Iterator[Table]:
    """Render a table, without its secondary columns where these do not fit.

    One whose words do not fit side by side is divided; its first column stands in each part.
    """
    places = list(range(len(block.head)))
    if sum(_measure(block, place)[1] for place in places) > width:
        places = [place for place in places if not block.head[place].secondary]
    while places:
        needed = accumulate(_measure(block, place)[0] for place in places)
        count = max(2, sum(one <= width for one in needed))
        yield _fill_table(block, places[:count], width)
        places = [places[0], *places[count:]] if places[count:] else []


def _measure(block: TableBlock, place: int) -> tuple[int, int]:
    """Return the least width of a column, that of its longest word, and the width of its texts.

    Both include the space beside it. A number is one word.
    """
    head = block.head[place]
    cells = [escape_text(text) for row in block.rows for text in row[place].texts]
    heads = [escape_text(text) for text in head.texts]
    words = [word for text in heads for word in text.split()]
    if head.number:
        heads = [*words, *(text[:_HEAD] for text in heads)]
        least = [*words, *cells]
    else:
        least = [*words, *(word for text in cells for word in text.split())]
    widths = (max(map(cell_len, texts), default=0) for texts in (least, [*cells, *heads]))
    smallest, whole = widths
    return smallest + _BESIDE, whole + _BESIDE


def _fill_table(block: TableBlock, places: Sequence[int], width: int) -> Table:
    """Fill a table with some columns in the one style; texts are broken at words."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
    least, whole = (list(one) for one in zip(*(_measure(block, k) for k in places), strict=True))
    free = width - sum(least)
    if free < 0:  # one word is wider than the terminal
        widest = least.index(max(least))
        least[widest] = max(least[widest] + free, _BESIDE + 1)
    order = sorted(range(len(places)), key=lambda k: whole[k] - least[k])
    for rank, k in enumerate(order):
        more = max(0, min(whole[k] - least[k], free // (len(order) - rank)))
        least[k] += more
        free -= more
    for place, room in zip(places, least, strict=True):
        head = block.head[place]
        table.add_column(
            Text("\n".join(escape_text(one) for one in head.texts)),
            justify="right" if head.number else "left",
            width=room - _BESIDE,
            overflow="fold",
        )
    for row in block.rows:
        table.add_row(*(_render_cell(row[place]) for place in places))
    return table


def _render_cell(cell: Cell) -> Text:
    """Render a cell: its text, and smaller texts below it."""
    style = _STYLES[cell.tone] if cell.badge else ""
    return Text("\n").join(
        Text(escape_text(text), style=style if text is cell.text else "dim") for text in cell.texts
    )
