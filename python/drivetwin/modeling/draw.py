# SPDX-License-Identifier: MIT
"""Schematic of a model as SVG: nodes as vertical shafts, elements as boxes between them."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from drivetwin.modeling.part import Node, Part

_STEP, _ROW, _TOP, _BOX = 150.0, 46.0, 46.0, (116.0, 32.0)
"""Distances of nodes and of rows, height of the head, and size of a box [px]."""


def draw_schematic(title: str, parts: Sequence[Part], ground: Node) -> str:
    """Return the SVG text: nodes in their order from left to right, one shaft each.

    Elements between nodes span them; those at one node hang on it. Elements share a row where
    they do not overlap. The ground is the last shaft, hatched.
    """
    nodes = _order_nodes(parts, ground)
    place = {node: _STEP * (0.6 + index) for index, node in enumerate(nodes)}
    spans = [
        (min(at), max(at))
        for at in ([place[port.node] for port in part.ports.values()] for part in parts)
    ]
    rows = _assign_rows(spans)
    height = _TOP + _ROW * (max(rows, default=0) + 1.4)
    width = _STEP * (len(nodes) + 0.2)
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" '
        f'width="{width:g}" height="{height:g}" font-family="sans-serif" font-size="11">',
        f"<title>{escape(title)}</title>",
    ]
    for node in nodes:
        lines += _draw_node(node, place[node], height, is_ground=node is ground)
    for part, row in zip(parts, rows, strict=True):
        lines += _draw_part(part, place, _TOP + _ROW * (row + 0.7))
    return "\n".join([*lines, "</svg>"]) + "\n"


def _order_nodes(parts: Sequence[Part], ground: Node) -> list[Node]:
    nodes = dict.fromkeys(port.node for part in parts for port in part.ports.values())
    turning = [node for node in nodes if node is not ground]
    return [*turning, ground] if ground in nodes else turning


def _assign_rows(spans: Sequence[tuple[float, float]]) -> list[int]:
    """First row of each span in which it overlaps no earlier one."""
    ends: list[list[tuple[float, float]]] = []
    rows = []
    margin = 0.5 * _BOX[0] + 4.0
    for low, high in spans:
        wide = (low - margin, high + margin)
        row = next(
            (i for i, used in enumerate(ends) if all(wide[0] > b or wide[1] < a for a, b in used)),
            len(ends),
        )
        if row == len(ends):
            ends.append([])
        ends[row].append(wide)
        rows.append(row)
    return rows


def _draw_node(node: Node, x: float, height: float, *, is_ground: bool) -> list[str]:
    dash = ' stroke-dasharray="3 3"' if is_ground else ""
    return [
        f'<line x1="{x:g}" y1="{_TOP - 14:g}" x2="{x:g}" y2="{height - 10:g}" '
        f'stroke="#888" stroke-width="3"{dash}/>',
        f'<text x="{x:g}" y="{_TOP - 22:g}" text-anchor="middle">{escape(node.name)}</text>',
    ]


def _draw_part(part: Part, place: dict[Node, float], y: float) -> list[str]:
    at = [place[port.node] for port in part.ports.values()]
    width, height = _BOX
    x = 0.5 * (min(at) + max(at))
    kind = part.kind.replace("_", " ")
    return [
        f'<line x1="{min(at):g}" y1="{y:g}" x2="{max(at):g}" y2="{y:g}" stroke="#333"/>',
        *(f'<circle cx="{end:g}" cy="{y:g}" r="3" fill="#333"/>' for end in dict.fromkeys(at)),
        f'<rect x="{x - width / 2:g}" y="{y - height / 2:g}" width="{width:g}" '
        f'height="{height:g}" rx="4" fill="#eef3fb" stroke="#335"/>',
        f'<text x="{x:g}" y="{y - 3:g}" text-anchor="middle">{escape(part.name)}</text>',
        f'<text x="{x:g}" y="{y + 11:g}" text-anchor="middle" fill="#667">{kind}</text>',
    ]
