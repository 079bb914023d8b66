# SPDX-License-Identifier: MIT
"""The growth curves as one SVG, drawn by hand: small, and the same on every machine."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

import numpy as np

from benchmarks.speed.growth import Curve

_WIDTH, _HEIGHT, _LEFT, _TOP, _BOTTOM, _RIGHT = 300, 230, 52, 26, 42, 12
_ROOM = 30
_INK, _LINE, _GRID = "#333333", "#1f5fa8", "#dddddd"


def svg(curves: Sequence[Curve], unit: float = 1e-6, sign: str = "µs") -> str:
    """Panels side by side; times in `unit` seconds, called `sign`."""
    panels = "".join(
        f'<g transform="translate({_WIDTH * place},0)">{_panel(curve, unit, sign)}</g>\n'
        for place, curve in enumerate(curves)
    )
    width = _WIDTH * len(curves)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {_HEIGHT}" '
        f'width="{width}" font-family="sans-serif" font-size="11" fill="{_INK}">\n'
        f'<rect width="{width}" height="{_HEIGHT}" fill="white"/>\n{panels}</svg>\n'
    )


def _panel(curve: Curve, unit: float, sign: str) -> str:
    right, foot = _WIDTH - _RIGHT, _HEIGHT - _BOTTOM
    x_end = 1.05 * max(x for x, _ in curve.points)
    times = [y / unit for _, y in curve.points]
    ticks = _decades(times) if curve.decades else _even(max(times))
    scale = np.log10 if curve.decades else np.float64
    low, high = float(scale(ticks[0])), float(scale(ticks[-1]))

    def x_of(value: float) -> float:
        return _LEFT + (right - _LEFT) * value / x_end

    def y_of(value: float) -> float:
        return foot - (foot - _TOP) * (float(scale(value)) - low) / (high - low)

    marks = [(x_of(x), y_of(y)) for (x, _), y in zip(curve.points, times, strict=True)]
    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in marks)
    parts = [
        f'<text x="{_LEFT}" y="15">time of a run [{escape(sign)}]</text>',
        *(_tick_y(y_of(v), v, right) for v in ticks),
        *(_tick_x(at, v, foot) for at, v in _apart([(x_of(x), x) for x, _ in curve.points])),
        f'<text x="{(_LEFT + right) / 2}" y="{_HEIGHT - 8}" text-anchor="middle">'
        f"{escape(curve.over)}</text>",
        f'<polyline points="{line}" fill="none" stroke="{_LINE}" stroke-width="1.5"/>',
        *(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{_LINE}"/>' for x, y in marks),
    ]
    return "".join(parts)


def _tick_y(at: float, value: float, right: float) -> str:
    return (
        f'<line x1="{_LEFT}" y1="{at:.1f}" x2="{right}" y2="{at:.1f}" stroke="{_GRID}"/>'
        f'<text x="{_LEFT - 6}" y="{at + 4:.1f}" text-anchor="end">{value:g}</text>'
    )


def _tick_x(at: float, value: float, foot: float) -> str:
    return f'<text x="{at:.1f}" y="{foot + 16}" text-anchor="middle">{value:g}</text>'


def _even(largest: float) -> list[float]:
    """Ticks from zero to a round number at or above the largest value."""
    power = 10.0 ** math.floor(math.log10(largest))
    end = next(n * power for n in (1, 2, 4, 6, 8, 10) if n * power >= largest)
    return [end * part / 4.0 for part in range(5)]


def _decades(values: Sequence[float]) -> list[float]:
    """Powers of ten around all values."""
    first, last = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
    return [10.0**power for power in range(first, max(last, first + 1) + 1)]


def _apart(ticks: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Those ticks that have room beside the one before."""
    kept: list[tuple[float, float]] = []
    for at, value in ticks:
        if not kept or at - kept[-1][0] >= _ROOM:
            kept.append((at, value))
    return kept
