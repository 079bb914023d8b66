# SPDX-License-Identifier: MIT
"""Figures of a fleet: a parameter over a field, its units side by side, friction of all logs."""

from __future__ import annotations

import numpy as np

from drivetwin._util.display_units import get_display_unit
from drivetwin.estimation.result.estimate import Z95
from drivetwin.fleet.mixed_model.mixed import FloatArray
from drivetwin.fleet.mixed_model.result import Drift, JointEstimate
from drivetwin.fleet.rules import is_date, to_datetime
from drivetwin.report.figure import Figure
from drivetwin.report.labels import get_parameter_label
from drivetwin.report.style import (
    ACCENT,
    BAND,
    FITTED,
    MEASURED,
    MUTED,
    make_axis,
    make_layout,
)

_MOST_POINTS = 4000


def plot_drift(one: JointEstimate) -> Figure:
    """Every log over the first field, with the shared line, its 95 % band, and outliers.

    Of very many logs every n-th is drawn.
    """
    display = get_display_unit(one.si_unit)
    drift, points = one.drifts[0], one.points
    out = np.isin(points.value, [outlier.value for outlier in one.outliers])
    stride = -(-points.value.size // _MOST_POINTS)
    kept = np.arange(0, points.value.size, stride)
    figure = Figure()
    for name, picked, colour, symbol in (
        ("log", kept[~out[kept]], MEASURED, "circle"),
        ("outlier", np.flatnonzero(out), ACCENT, "x"),
    ):
        if picked.size:
            figure.add_scatter(
                x=_convert_readings(drift.field, points.reading[picked]),
                y=display.to_display(points.value[picked]),
                text=[points.unit[k] for k in picked],
                mode="markers",
                name=name,
                marker={"color": colour, "size": 9 if symbol == "x" else 5, "symbol": symbol,
                        "opacity": 0.45 if name == "log" else 1.0},
                hovertemplate="unit %{text}: %{y:.4g}<extra></extra>",
            )  # fmt: skip
    _add_line(figure, one, drift)
    figure.merge_layout(
        **make_layout(
            380,
            xaxis=make_axis(drift.field),
            yaxis=make_axis(
                f"{get_parameter_label(one.parameter)} [{display.label}]", exponentformat="e"
            ),
            hovermode="closest",
        )
    )
    return figure


def _add_line(figure: Figure, one: JointEstimate, drift: Drift) -> None:
    """The shared line through the reference, and the band of its level and slope together."""
    display = get_display_unit(one.si_unit)
    ends = np.linspace(np.min(one.points.reading), np.max(one.points.reading), 41)
    away = ends - drift.reference
    middle = one.value + drift.slope * away
    level = 0.5 * (one.ci95[1] - one.ci95[0])
    slope = 0.5 * (drift.ci95[1] - drift.ci95[0])
    half = np.hypot(level, slope * away)
    x = _convert_readings(drift.field, ends)
    figure.add_scatter(
        x=np.concatenate((x, x[::-1])),
        y=display.to_display(np.concatenate((middle + half, (middle - half)[::-1]))),
        fill="toself",
        fillcolor=BAND,
        line={"width": 0},
        name="95 % of the fleet's mean",
        hoverinfo="skip",
    )
    figure.add_scatter(
        x=x,
        y=display.to_display(middle),
        mode="lines",
        name="fleet",
        line={"color": FITTED, "width": 2.2},
    )


def plot_units(one: JointEstimate) -> Figure:
    """Plot the sorted deviations of the units with 95 % intervals; highlight the outliers."""
    display = get_display_unit(one.si_unit)
    units = sorted(one.units, key=lambda unit: unit.deviation)
    figure = Figure()
    for odd, colour, name in ((False, MEASURED, "unit"), (True, ACCENT, "beyond chance")):
        picked = [(k, unit) for k, unit in enumerate(units) if unit.odd is odd]
        if not picked:
            continue
        figure.add_scatter(
            x=[k for k, _ in picked],
            y=[unit.deviation * display.factor for _, unit in picked],
            error_y={
                "array": [Z95 * unit.std * display.factor for _, unit in picked],
                "color": MUTED,
                "thickness": 1,
                "width": 0,
            },
            text=[unit.unit for _, unit in picked],
            mode="markers",
            name=name,
            marker={"color": colour, "size": 6},
            hovertemplate="unit %{text}: %{y:.3g}<extra></extra>",
        )
    few = len(units) <= 80
    ticks = [unit.unit for unit in units] if few else None
    figure.merge_layout(
        **make_layout(
            340,
            xaxis=make_axis(
                "unit, from low to high",
                tickvals=list(range(len(units))) if few else None,
                ticktext=ticks,
                showticklabels=few,
                tickfont={"size": 9},
            ),
            yaxis=make_axis(
                f"deviation of {get_parameter_label(one.parameter)} [{display.label}]",
                exponentformat="e",  # a prefix μ would be taken for friction
            ),
            hovermode="closest",
        )
    )
    return figure


def _convert_readings(
    field: str, readings: FloatArray
) -> FloatArray | np.ndarray[tuple[int], np.dtype[np.object_]]:
    """Convert readings for plotting; date fields become dates."""
    if not is_date(field):
        return readings
    return np.array([to_datetime(each) for each in readings], dtype=object)
