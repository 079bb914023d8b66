# SPDX-License-Identifier: MIT
"""Blocks of the report as parts of a view: the same tables and figures in both."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import repeat
from typing import Any

from dash import html
from dash.development.base_component import Component

from drivetwin.report.blocks import (
    Block,
    Cell,
    FigureBlock,
    NotesBlock,
    Section,
    TableBlock,
    TextBlock,
    Tile,
    TilesBlock,
    VerdictBlock,
)
from drivetwin.workbench.views.widgets import make_badge, make_graph, make_hint, make_notes


def render_section(section: Section, prefix: str) -> list[Component]:
    """A section under its title; `prefix` makes the ids of its figures its own."""
    intro = [make_hint(section.intro)] if section.intro else []
    blocks = [render_block(block, f"{prefix}-{k}") for k, block in enumerate(section.blocks)]
    return [html.H3(section.title), *intro, *blocks]


def render_block(block: Block, name: str) -> Component:
    """A block; `name` is the id of its figure."""
    match block:
        case VerdictBlock():
            return _render_verdict(block)
        case FigureBlock():
            figure = make_graph(name, block.caption.partition(".")[0], block.figure)
            return html.Div([figure, make_hint(block.caption)])
        case TableBlock():
            return render_table(block)
        case NotesBlock():
            return make_notes(block.heading, block.items, block.tone.value)
        case TextBlock():
            return html.P(block.text)
        case TilesBlock():
            return html.Div([_render_tile(one) for one in block.tiles], className="tiles")


def _render_verdict(block: VerdictBlock) -> Component:
    parts = [
        html.P(f"{block.subject}: {block.status}", className="word"),
        html.P(block.reason),
        html.P([html.Strong("Next:"), f" {block.action}"]),
    ]
    return html.Div(parts, className=f"verdict {block.tone}", role="status")


def _render_tile(tile: Tile) -> Component:
    return html.Div(
        [
            html.Span(tile.label, className="label"),
            html.Strong(tile.value),
            html.Small(tile.note),
        ],
        className=f"tile {tile.tone}",
    )


def render_table(
    block: TableBlock,
    heads: Sequence[str] = (),
    controls: Sequence[Sequence[Component | str]] = (),
    name: str = "",
) -> Component:
    """Render a table of the class `name`; `controls` are the rows of more columns under `heads`."""
    body = [
        html.Tr(
            [
                _render_cell(row[0], html.Th, scope="row"),
                *(_render_cell(one, html.Td) for one in row[1:]),
                *map(html.Td, own),
            ]
        )
        for row, own in zip(block.rows, controls or repeat(()), strict=bool(controls))
    ]
    top = html.Tr(
        [_render_cell(one, html.Th, scope="col") for one in (*block.head, *map(Cell, heads))]
    )
    caption = [html.Caption(block.caption)] if block.caption else []
    table = html.Table([*caption, html.Thead(top), html.Tbody(body)])
    return html.Div(table, className=f"table {name}".strip())


def _render_cell(cell: Cell, kind: type[html.Td] | type[html.Th], **options: Any) -> Component:
    content: list[Component | str] = [
        make_badge(cell.text, cell.tone.value) if cell.badge and cell.text else cell.text
    ]
    if cell.href:
        content = [html.A(cell.text, href=cell.href)]
    content += [html.Small(text) for text in (cell.note, cell.remark) if text]
    name = "number" if cell.number else "text"
    return kind(content, className=f"{name} secondary" if cell.secondary else name, **options)
