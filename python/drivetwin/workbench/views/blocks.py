# SPDX-License-Identifier: MIT
"""Blocks of the report as parts of a view: the same tables and figures in both."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from dash import html
from dash.development.base_component import Component

from drivetwin.report.sections.blocks import (
    Block,
    Cell,
    FigureBlock,
    NotesBlock,
    Section,
    TableBlock,
    Tile,
    TilesBlock,
)
from drivetwin.workbench.views.widgets import badge, graph, hint, notes


def shown(section: Section, prefix: str) -> list[Component]:
    """A section under its title; `prefix` makes the ids of its figures its own."""
    blocks = [_block(block, f"{prefix}-{k}") for k, block in enumerate(section.blocks)]
    return [html.H3(section.title), hint(section.intro), *blocks]


def _block(block: Block, name: str) -> Component:
    match block:
        case FigureBlock():
            figure = graph(name, block.caption.partition(".")[0], block.figure)
            return html.Div([figure, hint(block.caption)])
        case TableBlock():
            return _table(block.caption, block.head, block.rows)
        case NotesBlock():
            return notes(block.heading, block.items, block.tone.value)
        case TilesBlock():
            return html.Div([_tile(one) for one in block.tiles], className="tiles")


def _tile(tile: Tile) -> Component:
    return html.Div(
        [
            html.Span(tile.label, className="label"),
            html.Strong(tile.value),
            html.Small(tile.note),
        ],
        className=f"tile {tile.tone}",
    )


def _table(caption: str, head: Sequence[Cell], rows: Iterable[Sequence[Cell]]) -> Component:
    body = [
        html.Tr([_cell(row[0], html.Th, scope="row"), *(_cell(one, html.Td) for one in row[1:])])
        for row in rows
    ]
    top = html.Tr([_cell(one, html.Th, scope="col") for one in head])
    table = html.Table([html.Caption(caption), html.Thead(top), html.Tbody(body)])
    return html.Div(table, className="table")


def _cell(cell: Cell, kind: type[html.Td] | type[html.Th], **options: Any) -> Component:
    content: list[Component | str] = [
        badge(cell.text, cell.tone.value) if cell.badge and cell.text else cell.text
    ]
    content += [html.Small(text) for text in (cell.note, cell.remark) if text]
    return kind(content, className="number" if cell.number else "text", **options)
