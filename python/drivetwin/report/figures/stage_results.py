# SPDX-License-Identifier: MIT
"""Evidence of the paper's stages: grid searches and lock-up oscillation (eqs. 10 to 14)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import NM
from drivetwin.estimation.direct.ringdown import RingDown
from drivetwin.estimation.paper.wlse import GridFit
from drivetwin.report.figure import Figure, make_subplots
from drivetwin.report.figures.stack import Curve, Panel, compute_full_range, plot_over_time_axis
from drivetwin.report.style import (
    COMPARED,
    FITTED,
    MEASURED,
    MUTED,
    make_axis,
    make_layout,
)


@dataclass(frozen=True)
class WlseLabels:
    """Texts of one grid search; `unit` is that of the grid value."""

    grid: str
    unit: str
    acceleration: str
    torque: str
    inertia: str


def plot_wlse(fit: GridFit, labels: WlseLabels) -> Figure:
    """Scatter with the fitted line at the best grid value; RMS error over the grid next to it."""
    figure = make_subplots([0.62, 0.38], gaps=(0.12, 0.0))
    first = fit.rows[0].value
    inside = fit.weights >= 1.0
    groups = (
        (f"{labels.grid} = {first:g}", fit.torque_start, np.ones_like(inside), MUTED, 0.3),
        ("implausible quotient, weight 0.01", fit.torque, ~inside, COMPARED, 0.35),
        (f"{labels.grid} = {fit.best.value:g}, weight 1", fit.torque, inside, MEASURED, 0.7),
    )
    for name, torque, kept, colour, opacity in groups:
        figure.add_scatter(
            x=fit.acceleration[kept].astype("float32"),
            y=torque[kept].astype("float32"),
            mode="markers",
            name=name,
            marker={"color": colour, "size": 5, "opacity": opacity},
            row=1,
            col=1,
        )
    ends = _get_ends(fit.acceleration)
    figure.add_scatter(
        x=ends,
        y=ends * _compute_slope(fit),
        mode="lines",
        name=f"{labels.inertia} = {fit.best.inertia:.4g} kg·m²",
        line={"color": FITTED, "width": 2},
        row=1,
        col=1,
    )
    figure.add_scatter(
        x=[row.value for row in fit.rows],
        y=[row.rmse for row in fit.rows],
        mode="lines+markers",
        name="RMS error",
        showlegend=False,
        line={"color": MEASURED},
        row=1,
        col=2,
    )
    figure.add_scatter(
        x=[fit.best.value],
        y=[fit.best.rmse],
        mode="markers",
        name="least error",
        showlegend=False,
        marker={"color": FITTED, "size": 11, "symbol": "diamond"},
        row=1,
        col=2,
    )
    figure.merge_layout(
        **make_layout(430),
        xaxis=make_axis(labels.acceleration),
        yaxis=make_axis(labels.torque),
        xaxis2=make_axis(f"{labels.grid} [{labels.unit}]"),
        yaxis2=make_axis("RMS error at the output shaft [Nm]", rangemode="tozero"),
    )
    return figure


def _compute_slope(fit: GridFit) -> float:
    """Weighted least-squares slope of the scatter: J′ for eq. 10, J3/i_f for eq. 11."""
    normal = float(fit.weights @ fit.acceleration**2)
    return float(fit.weights @ (fit.acceleration * fit.torque)) / normal


def _get_ends(values: FloatArray) -> FloatArray:
    return np.array([min(0.0, float(values.min())), max(0.0, float(values.max()))])


def plot_ringdown(ring: RingDown) -> Figure:
    """Measured output torque with the extremes read from it."""
    measured = Curve("measured", ring.time, ring.torque, MEASURED, 1.1)
    panels = [Panel("output torque", NM, [measured])]
    figure = plot_over_time_axis(panels, compute_full_range(panels), 360)
    figure.add_scatter(
        x=ring.extremes_time,
        y=ring.extremes_torque,
        mode="markers",
        name="extremes of 10 ms means",
        marker={"color": FITTED, "size": 9, "symbol": "circle-open", "line": {"width": 2}},
        xaxis="x",
        yaxis="y",
    )
    for trace in figure.data:
        trace["showlegend"] = True
    return figure
