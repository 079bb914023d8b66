# SPDX-License-Identifier: MIT
"""Figures as plain data in the form that plotly.js draws, and the style that they share.

The Python library of plotly checks every entry, which takes longer than all else of a page. It is
imported where a notebook shows a figure; the tests check all figures with it.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from drivetwin._util.display_units import Display, get_display_unit
from drivetwin._util.text import escape_text
from drivetwin.channels.roles import get_command_element, get_pressure_element, get_quantity
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.parameters import OVER_ETA, get_parameter_spec

if TYPE_CHECKING:
    import plotly.graph_objects as go


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


class Entry(dict[str, Any]):
    """Part of a figure. Its entries are attributes as well; an absent one is None."""

    def __init__(self, entries: Mapping[str, Any] | None = None, **more: Any) -> None:
        both = {**(entries or {}), **more}
        super().__init__({key: _wrap(value) for key, value in both.items() if value is not None})

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return self.get(name)

    def merge(self, changes: Mapping[str, Any]) -> None:
        """Set entries; where both sides are tables, those of the table."""
        for key, value in Entry(changes).items():
            old = self.get(key)
            if isinstance(old, Entry) and isinstance(value, Entry):
                old.merge(value)
            else:
                self[key] = value


def _wrap(value: Any) -> Any:
    if isinstance(value, Mapping):
        return Entry(value)
    if isinstance(value, list | tuple):
        return [_wrap(one) if isinstance(one, Mapping | list | tuple) else one for one in value]
    return value


def make_trace(kind: str, **entries: Any) -> Entry:
    """Return a trace of a kind, `scatter`, `heatmap`, `bar` or `histogram`; None: no entry."""
    return Entry(type=kind, **entries)


class Figure:
    """Traces in `data` and a `layout`; with several panels, cells by row and column from 1 on."""

    def __init__(
        self, traces: Entry | Iterable[Entry] = (), layout: Mapping[str, Any] | None = None
    ) -> None:
        self.data: list[Entry] = [traces] if isinstance(traces, Entry) else list(traces)
        self.layout = Entry(layout)
        self.panels: Sequence[Any] = ()
        """Of a figure over time the panels with all samples; `data` begins with their curves."""
        self._suffixes: dict[tuple[int, int], str] = {(1, 1): ""}

    def set_layout(self, entries: Mapping[str, Any]) -> None:
        """Replace the layout."""
        self.layout = Entry(entries)

    def add_trace(self, trace: Entry, row: int = 1, col: int = 1) -> None:
        """Add a trace to a cell."""
        suffix = self._suffixes[row, col]
        if len(self._suffixes) > 1:
            trace |= {"xaxis": f"x{suffix}", "yaxis": f"y{suffix}"}
        self.data.append(trace)

    def add_scatter(self, row: int = 1, col: int = 1, **entries: Any) -> None:
        """Add curves or points to a cell."""
        self.add_trace(make_trace("scatter", **entries), row, col)

    def add_shape(self, **entries: Any) -> None:
        """Add a line or rectangle."""
        self.layout.setdefault("shapes", []).append(Entry(entries))

    def add_annotation(self, **entries: Any) -> None:
        """Add a text."""
        self.layout.setdefault("annotations", []).append(Entry(entries))

    def add_vline(self, x: float, line: Mapping[str, Any], row: int = 1, col: int = 1) -> None:
        """Add a vertical line through a cell."""
        suffix = self._suffixes[row, col]
        axes = {"xref": f"x{suffix}", "yref": f"y{suffix} domain"}
        self.add_shape(type="line", x0=x, x1=x, y0=0, y1=1, line=line, **axes)

    def merge_layout(self, **entries: Any) -> None:
        """Set entries of the layout, those of axes one by one."""
        self.layout.merge(entries)

    def update_axes(self, letter: str, entries: Mapping[str, Any], col: int | None = None) -> None:
        """Set entries of the `x` or `y` axes of a column, or of all."""
        for (_, column), suffix in self._suffixes.items():
            if col in (None, column):
                self.layout.merge({f"{letter}axis{suffix}": entries})

    def split(self, suffixes: Mapping[tuple[int, int], str], layout: Mapping[str, Any]) -> None:
        """Take over cells, by row and column the suffix of their axes, and the layout of these."""
        self._suffixes = dict(suffixes)
        self.layout = Entry(layout)

    def to_document(self) -> dict[str, Any]:
        """Return traces and layout for JSON, with arrays packed as plotly.js reads them."""
        return {"data": encode_entries(self.data), "layout": encode_entries(self.layout)}

    def to_plotly(self) -> go.Figure:
        """Return the figure as an object of plotly, which checks all entries."""
        import plotly.graph_objects as go

        return go.Figure(self.data, {**self.layout, "template": go.layout.Template()})


def encode_entries(value: Any) -> Any:
    """Convert entries to what JSON knows: arrays packed, numbers that are not finite null.

    Characters of a text that have no glyph become escapes.
    """
    if isinstance(value, str):
        return value if value.isprintable() else escape_text(value)
    if isinstance(value, Mapping):
        return {key: encode_entries(one) for key, one in value.items()}
    if isinstance(value, np.ndarray):
        return _encode_array(value)
    if isinstance(value, list | tuple):
        return [encode_entries(one) for one in value]
    if isinstance(value, np.datetime64):
        return str(value)
    if isinstance(value, np.generic):
        return encode_entries(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _encode_array(values: np.ndarray[Any, Any]) -> Any:
    if values.dtype.kind != "f":
        return encode_entries(list(values))
    kind = "f4" if values.dtype.itemsize <= 4 else "f8"
    packed = base64.b64encode(values.astype(f"<{kind}").tobytes()).decode("ascii")
    shape = {"shape": ", ".join(map(str, values.shape))} if values.ndim > 1 else {}
    return {"dtype": kind, "bdata": packed, **shape}


def make_subplots(
    widths: Sequence[float],
    heights: Sequence[float] = (1.0,),
    *,
    gaps: tuple[float, float] = (0.1, 0.0),
    titles: Sequence[str] = (),
) -> Figure:
    """Return a figure of several panels.

    Parameters
    ----------
    widths, heights : sequence of float
        Relative sizes of columns and rows, from the left and from the top.
    gaps : tuple of float
        Space between columns and between rows, as shares of the figure.
    titles : sequence of str
        Texts above the cells, row by row.
    """
    across, down = _divide(widths, gaps[0]), _divide(heights, gaps[1])
    cells = [(row, col) for row in range(1, len(down) + 1) for col in range(1, len(across) + 1)]
    suffixes = {cell: str(k) if k > 1 else "" for k, cell in enumerate(cells, start=1)}
    layout: dict[str, Any] = {"annotations": []}
    for k, ((row, column), suffix) in enumerate(suffixes.items()):
        rows = [1.0 - down[row - 1][1], 1.0 - down[row - 1][0]]
        layout[f"xaxis{suffix}"] = {"anchor": f"y{suffix}", "domain": list(across[column - 1])}
        layout[f"yaxis{suffix}"] = {"anchor": f"x{suffix}", "domain": rows}
        if k < len(titles):
            layout["annotations"].append(_make_title(titles[k], across[column - 1], rows[1]))
    figure = Figure()
    figure.split(suffixes, layout)
    return figure


def _divide(sizes: Sequence[float], gap: float) -> list[tuple[float, float]]:
    """Divide the length 1 into parts of relative `sizes` with a `gap` between them."""
    room = (1.0 - gap * (len(sizes) - 1)) / sum(sizes)
    ends = [sum(sizes[: k + 1]) * room + gap * k for k in range(len(sizes))]
    return [(float(end - size * room), float(end)) for size, end in zip(sizes, ends, strict=True)]


def _make_title(text: str, across: tuple[float, float], top: float) -> dict[str, Any]:
    return {
        "text": text,
        "font": {"size": 16},
        "showarrow": False,
        "x": 0.5 * sum(across),
        "xanchor": "center",
        "xref": "paper",
        "y": top,
        "yanchor": "bottom",
        "yref": "paper",
    }
