# SPDX-License-Identifier: MIT
"""Panels over one time axis, with phase bands, a cursor through all panels and zoom by phase.

A figure made here holds at most some 4000 points per curve, so that any browser draws it at once.
The report replaces them on zoom by all samples in view, from the panels of the figure.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import Display
from drivetwin.report.figure import (
    PHASE_FILL,
    PHASE_NUMBER,
    Entry,
    Figure,
    make_axis,
    make_layout,
    make_trace,
)

MAX_POINTS = 4000
_OUTSIDE = 600
"""Points on either side of a focus: enough for a view of the whole log."""


def extract_envelope(
    time: FloatArray, values: FloatArray, max_points: int = MAX_POINTS
) -> tuple[FloatArray, FloatArray]:
    """First, smallest, largest and last sample of equal bins, in time order.

    Traces (n,) of up to `max_points` come back unchanged. Every extreme of the trace is kept and
    the result is a subset of its samples. NaN samples are taken as gaps and left out of a bin
    unless the bin holds nothing else.
    """
    if time.size <= max_points:
        return time, values
    bins = np.linspace(0, time.size, max_points // 4 + 1).astype(np.intp)
    kept = _select_extremes(values, bins[:-1], bins[1:])
    return time[kept], values[kept]


def decimate_around(
    time: FloatArray, values: FloatArray, focus: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """Decimate a trace (n,) to its envelope outside `focus` [s]; keep all points inside.

    Traces of up to MAX_POINTS come back unchanged.
    """
    if time.size <= MAX_POINTS:
        return time, values
    first, last = np.searchsorted(time, focus)
    parts = [
        extract_envelope(time[:first], values[:first], _OUTSIDE),
        extract_envelope(time[first:last], values[first:last], MAX_POINTS - 2 * _OUTSIDE),
        extract_envelope(time[last:], values[last:], _OUTSIDE),
    ]
    return np.concatenate([t for t, _ in parts]), np.concatenate([v for _, v in parts])


def _select_extremes(
    values: FloatArray, starts: NDArray[np.intp], ends: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Indices of what is kept of each bin; a bin without a number keeps its first sample."""
    inside = starts[:, None] + np.arange(int(np.max(ends - starts)))
    binned = values[np.minimum(inside, values.size - 1)]
    known = (inside < ends[:, None]) & ~np.isnan(binned)
    lowest = np.argmin(np.where(known, binned, np.inf), axis=1)
    highest = np.argmax(np.where(known, binned, -np.inf), axis=1)
    last = np.where(known.any(axis=1), ends - 1, starts)
    return np.unique(np.concatenate((starts, starts + lowest, starts + highest, last)))


Phases = Mapping[str, tuple[float, float]]

_GAP = 0.035
_MARGIN = 0.06
"""Room above and below the curves, in shares of their span."""
_LEAST_SPAN = 0.04
"""Smallest span of a y axis in shares of its largest value: what hardly moves stays quiet."""
_FINE = 500.0
"""Time [s] below which single precision resolves 0.03 ms."""
_ZOOMS = {"torque": "torque phase", "inertia": "inertia phase", "after": "lock-up"}


@dataclass(frozen=True, eq=False)
class Curve:
    """One trace: `time` (n,) s, `values` (n,) SI."""

    name: str
    time: FloatArray
    values: FloatArray
    colour: str
    width: float = 1.3
    dash: str = "solid"
    step: bool = False
    """Drawn as a staircase: a value that is held until the next."""
    listed: bool = True
    """Named in the legend."""
    fill: str = ""
    """Colour of the area between it and the curve before it; empty: none."""
    says: str = ""
    """Word before its value where the mouse asks."""


@dataclass(frozen=True, eq=False)
class Panel:
    """One row: what its y axis shows, in which unit, and its curves. `weight` is its height."""

    quantity: str
    display: Display
    curves: Sequence[Curve]
    weight: float = 1.0


def stack_panels(panels: Sequence[Panel], phases: Phases, height: int) -> Figure:
    """Draw panels from top to bottom over a common time axis [s].

    `phases` maps `before`, `torque`, `inertia`, `after` to intervals [s]; the view opens on the
    shift, buttons zoom to the phases.
    """
    view = compute_shift_view(phases)
    buttons = build_zoom_buttons(panels, _compute_zooms(panels, phases, view))
    figure = plot_over_time_axis(panels, view, height, buttons)
    mark_phases(figure, phases)
    return figure


def plot_over_time_axis(
    panels: Sequence[Panel],
    view: tuple[float, float],
    height: int,
    buttons: Mapping[str, Any] | None = None,
) -> Figure:
    """Draw panels from top to bottom over a common time axis [s] that opens on `view`.

    `buttons` are those of `build_zoom_buttons`; None: no buttons.
    """
    domains = _compute_domains([panel.weight for panel in panels])
    ranges = compute_y_ranges(panels, view)
    traces: list[Entry] = []
    options: dict[str, Any] = {}
    for number, (panel, domain) in enumerate(zip(panels, domains, strict=True), start=1):
        suffix = "" if number == 1 else str(number)
        axis = f"yaxis{suffix}"
        shown = {"range": ranges[axis]} if axis in ranges else {}
        options[axis] = {**_build_y_axis(panel, domain), **shown}
        options[f"legend{suffix}"] = {
            "x": 1.01,
            "y": domain[1],
            "yanchor": "top",
            "bgcolor": "rgba(0,0,0,0)",
        }
        traces += [_build_trace(curve, panel, suffix, view) for curve in panel.curves]
    options["xaxis"] = make_axis(
        "time [s]",
        anchor=f"y{len(panels)}" if len(panels) > 1 else "y",
        range=view,
        showspikes=True,
        spikemode="across",
        spikethickness=1,
        spikedash="dot",
        spikecolor="#8a8f98",
    )
    options["margin"] = {"l": 70, "r": 150, "t": 64 if buttons else 30, "b": 50}
    if buttons:
        options["updatemenus"] = [buttons]
    # Given at once: an update of the layout takes plotly as long as ten figures.
    layout = make_layout(height, hovermode="x unified", hoversubplots="axis", **options)
    figure = Figure(traces, layout)
    figure.panels = panels
    return figure


def compute_y_ranges(
    panels: Sequence[Panel], view: tuple[float, float]
) -> dict[str, tuple[float, float]]:
    """Range in display units by y axis (`yaxis`, `yaxis2`, ...) that shows what is in `view` [s].

    A panel without a sample in view has none.
    """
    found = {}
    for number, panel in enumerate(panels, start=1):
        parts = [panel.display.to_display(_select_in_view(curve, view)) for curve in panel.curves]
        values = np.concatenate([part[np.isfinite(part)] for part in parts] or [np.empty(0)])
        if values.size:
            low, high = float(values.min()), float(values.max())
            span = max(high - low, _LEAST_SPAN * max(abs(low), abs(high)), 1e-12)
            middle, half = 0.5 * (low + high), (0.5 + _MARGIN) * span
            found["yaxis" if number == 1 else f"yaxis{number}"] = (middle - half, middle + half)
    return found


def _select_in_view(curve: Curve, view: tuple[float, float]) -> FloatArray:
    """Samples in view: of held values with the one before it, of others with the one after."""
    first, last = np.searchsorted(curve.time, view)
    return curve.values[max(0, first - 1) : last] if curve.step else curve.values[first : last + 1]


def _build_y_axis(panel: Panel, domain: tuple[float, float]) -> dict[str, Any]:
    ticks = 3 + round(12 * (domain[1] - domain[0]))
    title = f"{panel.quantity}<br>[{panel.display.label}]"
    return make_axis(title, domain=domain, anchor="x", nticks=ticks)


def _compute_domains(weights: Sequence[float]) -> list[tuple[float, float]]:
    """Vertical extents from top to bottom, in shares of the plot's height."""
    usable = 1.0 - _GAP * (len(weights) - 1)
    domains, top = [], 1.0
    for weight in weights:
        bottom = top - usable * weight / sum(weights)
        domains.append((max(0.0, bottom), top))
        top = bottom - _GAP
    return domains


def _build_trace(curve: Curve, panel: Panel, suffix: str, view: tuple[float, float]) -> Entry:
    time, values = decimate_around(curve.time, curve.values, view)
    return make_trace(
        "scatter",
        x=time.astype("float32" if np.abs(time).max(initial=0.0) < _FINE else "float64"),
        y=panel.display.to_display(values).astype("float32"),
        name=curve.name,
        mode="lines",
        line={
            "color": curve.colour,
            "width": curve.width,
            "dash": curve.dash,
            "shape": "hv" if curve.step else "linear",
        },
        xaxis="x",
        yaxis=f"y{suffix}",
        legend=f"legend{suffix}",
        fill="tonexty" if curve.fill else None,
        fillcolor=curve.fill or None,
        showlegend=curve.listed and len(panel.curves) > 1,
        hovertemplate=f"{curve.says} %{{y:.5~g}} {panel.display.label}".lstrip(),
    )


def compute_shift_view(phases: Phases) -> tuple[float, float]:
    """The shift with half a second before and one second after it."""
    start, end = phases["torque"][0], phases["inertia"][1]
    return max(phases["before"][0], start - 0.5), min(phases["after"][1], end + 1.0)


def _compute_zooms(
    panels: Sequence[Panel], phases: Phases, view: tuple[float, float]
) -> dict[str, tuple[float, float]]:
    """Views to choose from, by label."""
    zooms = {"shift": view, "whole": compute_full_range(panels)}
    for phase, label in _ZOOMS.items():
        start, end = phases[phase]
        end = min(end, start + 1.0)
        margin = 0.1 * (end - start)
        zooms[label] = (start - margin, end + margin)
    return zooms


def compute_full_range(panels: Sequence[Panel]) -> tuple[float, float]:
    """Time that the curves cover together [s]."""
    times = [curve.time for panel in panels for curve in panel.curves if curve.time.size]
    return float(min(time[0] for time in times)), float(max(time[-1] for time in times))


def build_zoom_buttons(
    panels: Sequence[Panel], zooms: Mapping[str, tuple[float, float]]
) -> dict[str, Any]:
    """Buttons above the panels, one for each labelled view [s]; each fits the y axes too."""
    buttons = []
    for label, span in zooms.items():
        fitted = {
            f"{name}.range": list(two) for name, two in compute_y_ranges(panels, span).items()
        }
        change = {"xaxis.range": list(span), **fitted}
        buttons.append({"label": label, "method": "relayout", "args": [change]})
    return {
        "type": "buttons",
        "direction": "right",
        "showactive": False,
        "x": 0,
        "xanchor": "left",
        "y": 1.0,
        "yanchor": "bottom",
        "pad": {"b": 22, "t": 0},
        "font": {"size": 11},
        "buttons": buttons,
    }


def mark_phases(figure: Figure, phases: Phases) -> None:
    """Shade torque and inertia phase and number all four phases above the top panel."""
    shade_phases(figure, phases)
    for phase, (start, end) in phases.items():
        place, anchor = {
            "before": (end, "right"),
            "after": (start, "left"),
        }.get(phase, (0.5 * (start + end), "center"))
        write_above(figure, place, PHASE_NUMBER[phase], anchor)


def shade_phases(figure: Figure, phases: Phases) -> None:
    """Shade torque and inertia phase through all panels."""
    for phase in ("torque", "inertia"):
        start, end = phases[phase]
        figure.add_shape(
            type="rect",
            xref="x",
            yref="paper",
            x0=start,
            x1=end,
            y0=0,
            y1=1,
            fillcolor=PHASE_FILL[phase],
            line={"width": 0},
            layer="below",
        )


def write_above(figure: Figure, time: float, text: str, anchor: str = "center") -> None:
    """Write a few letters above the top panel at a time [s]."""
    figure.add_annotation(
        x=time,
        xref="x",
        y=1.0,
        yref="paper",
        yanchor="bottom",
        xanchor=anchor,
        text=f"<b>{text}</b>",
        showarrow=False,
    )
