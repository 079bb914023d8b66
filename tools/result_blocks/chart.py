# SPDX-License-Identifier: MIT
"""A chart with two logarithmic axes, as SVG."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

Point = tuple[float, float]
_INK, _GREY = "#1f2933", "#cbd2d9"
_COLOURS = (
    *("#0b6bcb", "#c4432b", "#2b8a3e", "#8f3fb0", "#b7791f"),
    *("#0c8599", "#7b8794", "#d6336c", "#495057", "#5c940d"),
)
_LEFT, _TOP, _WIDTH, _HEIGHT, _LEGEND = 70.0, 20.0, 460.0, 340.0, 230.0
"""Margins, area of the axes and width of the legend."""


def draw_chart(lines: Mapping[str, Sequence[Point]], across: str, up: str) -> str:
    """Draw the points (x, y), above zero, of each line by its name."""
    points = [point for line in lines.values() for point in line]
    x_axis, y_axis = (_choose_decades(point[i] for point in points) for i in (0, 1))

    def place(point: Point) -> Point:
        x = (math.log10(point[0]) - x_axis[0]) / (x_axis[1] - x_axis[0])
        y = (math.log10(point[1]) - y_axis[0]) / (y_axis[1] - y_axis[0])
        return _LEFT + _WIDTH * x, _TOP + _HEIGHT * (1.0 - y)

    parts = [
        *(
            _draw_tick(place((10.0**n, 10.0 ** y_axis[0])), n, upright=True)
            for n in range(*_over(x_axis))
        ),
        *(
            _draw_tick(place((10.0 ** x_axis[0], 10.0**n)), n, upright=False)
            for n in range(*_over(y_axis))
        ),
        _draw_text((_LEFT + _WIDTH / 2, _TOP + _HEIGHT + 42), across, "middle"),
        f'<g transform="rotate(-90 16 {_TOP + _HEIGHT / 2:g})">'
        + _draw_text((16, _TOP + _HEIGHT / 2), up, "middle")
        + "</g>",
    ]
    for number, (name, line) in enumerate(lines.items()):
        colour = _COLOURS[number % len(_COLOURS)]
        spots = [place(point) for point in line]
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in spots)
        parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}"/>')
        beside = (_LEFT + _WIDTH + 24.0, _TOP + 10.0 + 20.0 * number)
        parts += [_draw_dot(spot, colour) for spot in (*spots, beside)]
        parts.append(_draw_text((beside[0] + 10.0, beside[1] + 4.0), name, "start"))
    size = f'width="{_LEFT + _WIDTH + _LEGEND:g}" height="{_TOP + _HEIGHT + 56:g}"'
    body = "\n".join(parts)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif" font-size="13">\n'
        f'<rect width="100%" height="100%" fill="#ffffff"/>\n{body}\n</svg>\n'
    )


def _choose_decades(values: Iterable[float]) -> tuple[int, int]:
    """Return the whole decades that hold the values."""
    logs = [math.log10(value) for value in values]
    low = math.floor(min(logs))
    return low, max(math.ceil(max(logs)), low + 1)


def _over(decades: tuple[int, int]) -> tuple[int, int]:
    return decades[0], decades[1] + 1


def _draw_tick(at: Point, decade: int, *, upright: bool) -> str:
    """Draw the line of the grid at a decade and its label."""
    x, y = at
    end = (x, _TOP) if upright else (_LEFT + _WIDTH, y)
    label = f'10<tspan font-size="9" dy="-5">{decade}</tspan>'
    spot = (x, y + 18.0) if upright else (x - 8.0, y + 4.0)
    line = f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{end[0]:.1f}" y2="{end[1]:.1f}" stroke="{_GREY}"/>'
    return line + _draw_text(spot, label, "middle" if upright else "end")


def _draw_dot(at: Point, colour: str) -> str:
    return f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="3.5" fill="{colour}"/>'


def _draw_text(at: Point, text: str, anchor: str) -> str:
    place = f'x="{at[0]:.1f}" y="{at[1]:.1f}" text-anchor="{anchor}"'
    return f'<text {place} fill="{_INK}">{text}</text>'
