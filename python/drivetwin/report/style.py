# SPDX-License-Identifier: MIT
"""Colours and layout shared by all figures: Okabe-Ito, safe for colour-blind readers.

The blue is a little lighter than the original so that it also reads on a dark page.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drivetwin._util.display_units import Display, get_display_unit
from drivetwin.channels.roles import get_command_element, get_pressure_element, get_quantity
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.parameters import OVER_ETA, get_parameter_spec


def get_parameter_label(parameter_id: str) -> str:
    """Symbol with the gear or element it belongs to, e.g. `J′ (2)`."""
    spec = get_parameter_spec(parameter_id)
    suffix = parameter_id.removeprefix(spec.stem).removesuffix(OVER_ETA).lstrip("_.")
    return f"{spec.symbol} ({suffix})" if suffix else spec.symbol


def get_parameter_name(parameter_id: str) -> str:
    """Name before symbol, e.g. `Efficiency η` or `Inertia at engine J′ (2)`."""
    name = get_parameter_spec(parameter_id).name
    return f"{name[0].upper()}{name[1:]} {get_parameter_label(parameter_id)}"


def get_estimate_name(estimate: Estimate) -> str:
    """Name of an estimate: that of its parameter, or its own where the table has none."""
    return estimate.spec.name if estimate.spec else get_parameter_name(estimate.id)


def get_estimate_label(estimate: Estimate) -> str:
    """Symbol of an estimate: that of its parameter, or its own where the table has none."""
    return estimate.spec.symbol if estimate.spec else get_parameter_label(estimate.id)


def get_channel_label(role: str) -> str:
    """Role of a channel in words, e.g. `output torque` or `pressure B2`."""
    return role.replace("_", " ").replace(".", " ")


_SYMBOLS = {
    "engine_torque": "T_e",
    "output_torque": "T_o",
    "input_speed": "n_in",
    "engine_speed": "n_e",
    "output_speed": "n_out",
    "wheel_speed": "n_w",
}


def get_channel_symbol(role: str) -> str:
    """Return the symbol of a channel, e.g. `T_o` or `P B2`; the role itself without a symbol."""
    if (commanded := get_command_element(role)) is not None:
        return f"P* {commanded}"
    element = get_pressure_element(role)
    return _SYMBOLS.get(role, role) if element is None else f"P {element}"


def get_channel_display(role: str) -> Display:
    """Display unit of a channel by its role. Raises KeyError for a role that does not exist."""
    return get_display_unit(get_quantity(role).unit)


MEASURED = "#1A7FC4"
SIMULATED = "#D55E00"
FITTED = "#D55E00"
COMPARED = "#009E73"
ACCENT = "#CC79A7"
SECOND = "#E69F00"
MUTED = "#8a8f98"
SERIES = (MEASURED, SIMULATED, COMPARED, SECOND, ACCENT, MUTED)
"""Colours of curves of equal rank."""
BAND = "rgba(213,94,0,0.18)"
"""Filling of a 95 % band."""
UNDER, OVER = 4.0, 1.1
"""Widths of a simulated line and of the measured one over it: both are visible where they agree."""

VERDICT_COLOURS = {
    Verdict.IDENTIFIED: "#009E73",
    Verdict.WEAK: "#E69F00",
    Verdict.NOT_IDENTIFIABLE: MUTED,
    Verdict.DESIGN: MUTED,
}

DIVERGING = [[0.0, "#D55E00"], [0.5, "#f4f4f4"], [1.0, "#0072B2"]]
"""From vermilion over white to blue, distinguishable in every kind of colour vision."""

PHASE_FILL = {
    "before": "rgba(0,0,0,0)",
    "torque": "rgba(230,159,0,0.16)",
    "inertia": "rgba(86,180,233,0.18)",
    "after": "rgba(0,0,0,0)",
}
PHASE_NUMBER = {"before": "1", "torque": "2", "inertia": "3", "after": "4"}


@dataclass(frozen=True)
class CandidateStyle:
    """Drawing style of one compared item: colour, pale colour, dash and marker."""

    colour: str
    fill: str
    dash: str
    symbol: str


_CANDIDATES = (
    ("#D55E00", "circle"),
    ("#009E73", "diamond"),
    ("#E69F00", "square"),
    ("#CC79A7", "triangle-up"),
    ("#56B4E9", "x"),
    (MUTED, "cross"),
)
_DASHES = ("solid", "dash", "dot", "dashdot")


def get_candidate_style(index: int) -> CandidateStyle:
    """Style of the `index`-th of several: six colours with markers, then again dashed."""
    colour, symbol = _CANDIDATES[index % len(_CANDIDATES)]
    dash = _DASHES[index // len(_CANDIDATES) % len(_DASHES)]
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return CandidateStyle(colour, f"rgba({red},{green},{blue},0.15)", dash, symbol)


FONT = "Inter, 'Segoe UI', system-ui, -apple-system, 'Liberation Sans', sans-serif"
GRID = "rgba(128,128,128,0.22)"


def make_axis(title: str, **extra: Any) -> dict[str, Any]:
    """Axis with a title that carries the unit and a quiet grid."""
    return {
        "title": {"text": title, "standoff": 8},
        "gridcolor": GRID,
        "linecolor": "rgba(128,128,128,0.6)",
        "zeroline": False,
        "ticks": "outside",
        "ticklen": 4,
        "automargin": True,
        **extra,
    }


def make_layout(height: int, **extra: Any) -> dict[str, Any]:
    """Return the common layout of all figures; the background is transparent."""
    return {
        "height": height,
        "margin": {"l": 70, "r": 20, "t": 30, "b": 50},
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"family": FONT, "size": 12, "color": "#333a44"},
        "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": MUTED, "activecolor": MEASURED},
        "hoverlabel": {"font": {"family": FONT, "size": 12}},
        "legend": {"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom"},
        **extra,
    }
