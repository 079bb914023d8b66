# SPDX-License-Identifier: MIT
"""Draw the figures of docs/theory.md.

`python -m tools.theory_figures` writes docs/img/theory-*.svg: the scheme of the dual-clutch
driveline, the phases of a simulated shift, and the ellipse of one unknown and one effect.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "img"
INK, GREY, BAND = "#1f2933", "#7b8794", "#eef2f6"
COLOURS = ("#0b6bcb", "#c4432b", "#2b8a3e")
CORRELATION, POWER = 0.8, 9.0
"""Correlation of the effect's column with that of the unknown, and its power over noise."""
START, END, STEP = 2.05, 3.2, 3
"""Part of the shift that is drawn [s], and every how many samples (of 1 ms)."""

FloatArray = NDArray[np.float64]
Point = tuple[float, float]


def draw_text(at: Point, text: str, *, anchor: str = "middle", size: float = 14.0) -> str:
    """Draw text; what follows an underscore in a word is its subscript."""
    body = " ".join(_format_word(word, size) for word in text.split(" "))
    place = f'x="{at[0]:g}" y="{at[1]:g}" text-anchor="{anchor}" font-size="{size:g}"'
    return f'<text {place} fill="{INK}">{body}</text>'


def _format_word(word: str, size: float) -> str:
    base, _, index = word.partition("_")
    if not index:
        return base
    small, down = 0.72 * size, 0.28 * size
    lowered = f'<tspan font-size="{small:.1f}" dy="{down:.1f}">{index}</tspan>'
    return f'{base}{lowered}<tspan dy="{-down:.1f}">\u200b</tspan>'


def draw_path(points: Iterable[Point], colour: str = INK, more: str = "") -> str:
    """Draw a line through points."""
    text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline points="{text}" fill="none" stroke="{colour}" stroke-width="1.6" {more}/>'


def draw_box(centre: Point, text: str, width: float = 56.0, height: float = 44.0) -> str:
    """Draw a box with text in it."""
    x, y = centre[0] - width / 2, centre[1] - height / 2
    frame = f'x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="4"'
    box = f'<rect {frame} fill="{BAND}" stroke="{INK}" stroke-width="1.6"/>'
    return box + draw_text((centre[0], centre[1] + 5), text)


def draw_arrow(start: Point, end: Point, colour: str = INK) -> str:
    """Draw a horizontal arrow."""
    back = 7.0 if end[0] > start[0] else -7.0
    tip = [(end[0] - back, end[1] - 4), end, (end[0] - back, end[1] + 4)]
    return draw_path([start, end], colour) + draw_path(tip, colour)


def build_page(width: float, height: float, parts: Sequence[str], title: str) -> str:
    """Put the parts on a white sheet, which is readable on a dark page too."""
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}"'
    font = 'font-family="Helvetica, Arial, sans-serif" role="img"'
    sheet = f'<rect width="{width:g}" height="{height:g}" rx="6" fill="white"/>'
    opening = f'{head} width="{width:g}" height="{height:g}" {font}>\n<title>{title}</title>'
    return "\n".join([opening, sheet, *parts, "</svg>\n"])


def draw_driveline() -> str:
    """Draw the scheme of the dual-clutch driveline."""
    y, upper, lower = 120.0, 62.0, 178.0
    parts = [
        draw_arrow((14, y), (52, y)),
        draw_text((30, y - 12), "T_e"),
        draw_path([(106, y), (226, y)]),
        draw_box((80, y), "J_1"),
        draw_box((152, y), "i_in η"),
        draw_box((224, y), "J_2e"),
        draw_text((80, y + 42), "ω_e"),
    ]
    for level, k in ((upper, "1"), (lower, "2")):
        parts += [
            draw_path([(252, y), (272, y), (272, level), (346, level)]),
            draw_path([(354, level), (438, level), (438, y), (458, y)]),
            draw_box((308, level), f"i_c,{k}", 50),
            draw_box((402, level), f"i_out,{k}", 54),
            draw_path([(346, level - 20), (346, level + 20)]),
            draw_path([(354, level - 20), (354, level + 20)]),
            draw_text((350, level - 28), f"T_{k} s_{k}"),
        ]
    parts += [
        draw_box((486, y), "J_o′"),
        draw_text((486, y + 42), "ω_out"),
        draw_path([(514, y), (526, y), (526, y - 16), (534, y - 16)]),
        draw_path(
            [(534 + 5 * k, y - 16 + (0 if k in (0, 8) else 7 * (-1) ** k)) for k in range(9)]
        ),
        draw_path([(574, y - 16), (582, y - 16), (582, y), (594, y)]),
        draw_path([(526, y), (526, y + 16), (550, y + 16)]),
        draw_path([(550, y + 8), (550, y + 24)]),
        draw_path([(562, y + 7), (545, y + 7)]) + draw_path([(562, y + 25), (545, y + 25)]),
        draw_path([(562, y + 7), (562, y + 25)]),
        draw_path([(562, y + 16), (582, y + 16), (582, y)]),
        draw_text((554, y - 32), "k_o T_o"),
        draw_text((554, y + 46), "c_o"),
        draw_path([(594, y), (680, y)]),
        draw_box((616, y), "i_f", 44),
        draw_box((684, y), "J_v"),
        draw_text((684, y + 42), "ω_w"),
        draw_arrow((752, y), (716, y)),
        draw_text((738, y - 12), "T_v"),
    ]
    return build_page(766, 236, parts, "Scheme of the dual-clutch driveline")


def draw_panel(
    frame: tuple[float, float, float],
    time: FloatArray,
    lines: Mapping[str, FloatArray],
    label: str,
) -> list[str]:
    """Draw curves over time; `frame` is top, height and width of the panel."""
    top, height, width = frame
    values = np.concatenate(list(lines.values()))
    low, high = float(np.min(values)), float(np.max(values))
    x = 70 + width * (time - START) / (END - START)
    parts = [
        draw_path([(70, top), (70, top + height), (70 + width, top + height)], GREY),
        draw_text((64, top + 10), f"{high:.0f}", anchor="end", size=11),
        draw_text((64, top + height), f"{low:.0f}", anchor="end", size=11),
        draw_text((76, top - 5), label, anchor="start", size=12),
    ]
    for index, (name, values) in enumerate(lines.items()):
        y = top + height * (1 - (values - low) / (high - low))
        colour = COLOURS[index]
        parts.append(draw_path(zip(x, y, strict=True), colour))
        parts.append(f'<g fill="{colour}">' + _draw_key(name, colour, top, index, width) + "</g>")
    return parts


def _draw_key(name: str, colour: str, top: float, index: int, width: float) -> str:
    at = 70 + width + 12, top + 16 + 20 * index
    return draw_path([(at[0], at[1] - 4), (at[0] + 18, at[1] - 4)], colour) + draw_text(
        (at[0] + 24, at[1]), name, anchor="start", size=12
    )


def draw_shift() -> str:
    """Simulate the shift of the scenario `paper_steps` and draw it with its four phases."""
    made = run(load_scenario("paper_steps"), seed=0)
    model, shown = made.scenario.model, made.trajectory
    (at,) = made.truth.shifts
    picked = np.flatnonzero((shown.time >= START) & (shown.time <= END))[::STEP]
    time, output = shown.time[picked], shown.output_speed[picked]
    old, new = model.elements
    width, bottom = 480.0, 420.0
    borders = np.array([START, at.torque_start, at.inertia_start, at.lockup, END], dtype=float)
    place = 70 + width * (borders - START) / (END - START)
    parts = [
        f'<rect x="{place[k]:.1f}" y="28" width="{place[k + 1] - place[k]:.1f}" '
        f'height="{bottom - 28:g}" fill="{BAND}"/>'
        for k in (1, 3)
    ]
    parts += [
        draw_text((0.5 * (place[k] + place[k + 1]), 20), str(k + 1), size=13) for k in range(4)
    ]
    speeds = {
        "ω_in": shown.engine_speed[picked] / model.i_in,
        "old gear": old.i_c * old.i_out * output,
        "new gear": new.i_c * new.i_out * output,
    }
    torques = {
        "off-going": shown.clutch_torque[old.name][picked],
        "on-coming": shown.clutch_torque[new.name][picked],
    }
    parts += draw_panel((50, 100, width), time, speeds, "speed at the gearbox input [rad/s]")
    parts += draw_panel((184, 100, width), time, torques, "clutch torque [N·m]")
    shaft = {"T_o": shown.shaft_torque[picked]}
    parts += draw_panel((318, 100, width), time, shaft, "output-shaft torque [N·m]")
    for tick in np.arange(2.2, END + 1e-9, 0.2):
        x = 70 + width * (tick - START) / (END - START)
        parts.append(draw_text((x, bottom + 16), f"{tick:.1f}", size=11))
    parts.append(draw_text((70 + width + 12, bottom + 16), "time [s]", anchor="start", size=12))
    return build_page(680, 446, parts, "Phases of a power-on upshift")


def build_ellipse(correlation: float, power: float) -> FloatArray:
    """Compute points (n, 2) at which Q has risen by 1: error of the unknown, amount of the effect.

    Both have unit information: the error is counted in standard deviations without the effect, the
    amount in prior standard deviations.
    """
    cross = correlation * np.sqrt(power)
    factor = np.linalg.cholesky(np.linalg.inv([[1.0, cross], [cross, power + 1.0]]))
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    return np.asarray((factor @ np.array([np.cos(angle), np.sin(angle)])).T)


def draw_effect() -> str:
    """Draw the ellipses of one unknown and one effect."""
    x0, y0, scale = 210.0, 150.0, 95.0

    def place(points: Any) -> list[Point]:
        return [(x0 + scale * float(x), y0 - scale * float(y)) for x, y in points]

    strong = build_ellipse(CORRELATION, POWER)
    weak = build_ellipse(CORRELATION, POWER / 9.0)
    wide = float(np.max(strong[:, 0]))
    low = -1.12
    dotted = 'stroke-dasharray="2 4"'
    parts = [
        draw_arrow((20, y0), (520, y0), GREY),
        draw_path([(x0, 285), (x0, 20)], GREY),
        draw_text((520, y0 - 10), "error of the unknown", anchor="end", size=12),
        draw_text((x0 + 8, 26), "amount of the effect", anchor="start", size=12),
        draw_path(place(strong), COLOURS[0]),
        draw_path(place(weak), COLOURS[0], 'stroke-dasharray="6 4"'),
        *(draw_path(place([(x, 0), (x, low)]), GREY, dotted) for x in (-wide, wide)),
        draw_path(place([(-1, 0), (1, 0)]), COLOURS[1], 'stroke-linecap="round"'),
        draw_path(place([(-wide, low), (wide, low)]), COLOURS[2]),
        draw_text((x0 - scale * 0.48, y0 - 8), "without effect", size=12),
        draw_text((x0 + 6, y0 - scale * low + 18), "with effect", anchor="start", size=12),
    ]
    return build_page(540, 300, parts, "One unknown and one effect")


FIGURES: Mapping[str, Callable[[], str]] = {
    "theory-driveline.svg": draw_driveline,
    "theory-shift.svg": draw_shift,
    "theory-effect.svg": draw_effect,
}
"""Figures by file name."""


def main() -> int:
    """Write the figures."""
    for name, draw in FIGURES.items():
        path = FOLDER / name
        path.write_text(draw(), encoding="utf-8")
        print(f"wrote {path} ({path.stat().st_size / 1e3:.0f} kB)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
