# SPDX-License-Identifier: MIT
"""Evidence of the stages: inertia, load, grid search, lock-up oscillation (eqs. 10 to 14)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import NM
from drivetwin.estimation.linear.load_balance import LoadFit
from drivetwin.estimation.linear.momentum_balance import MomentumFit
from drivetwin.estimation.linear.ringdown import RingDown
from drivetwin.estimation.paper.wlse import GridFit
from drivetwin.report.figure import Figure, make_subplots
from drivetwin.report.figures.stack import Curve, Panel, compute_full_range, plot_over_time_axis
from drivetwin.report.style import (
    COMPARED,
    FITTED,
    MEASURED,
    MUTED,
    SECOND,
    make_axis,
    make_layout,
)


def plot_load(fit: LoadFit, final_drive: float | None) -> Figure:
    """Surplus torque over wheel acceleration, one point per window, with the slope J3/i_f.

    Without `final_drive` only the points are drawn.
    """
    figure = Figure()
    figure.add_scatter(
        x=fit.acceleration,
        y=fit.torque,
        mode="markers",
        name="windows",
        marker={"color": MEASURED, "size": 6, "opacity": 0.7},
    )
    if final_drive is not None:
        ends = np.array([min(0.0, fit.acceleration.min()), max(0.0, fit.acceleration.max())])
        figure.add_scatter(
            x=ends,
            y=ends * fit.J_vehicle / final_drive,
            mode="lines",
            name=f"J3 = {fit.J_vehicle:.4g} kg·m²",
            line={"color": FITTED, "width": 1.8},
        )
    figure.set_layout(
        make_layout(
            400,
            xaxis=make_axis("wheel acceleration ω_w′, window mean [rad/s²]"),
            yaxis=make_axis("T_o − T_v/i_f, window mean [Nm]"),
        )
    )
    return figure


_STRETCHES = {
    "before": ("gear before the shift", MEASURED),
    "inertia": ("inertia phase", SECOND),
    "after": ("gear after the shift", COMPARED),
}


_SCAN_VIEW = 0.025
"""Delays shown on either side of the best one [s]."""


def plot_momentum(fit: MomentumFit) -> Figure:
    """Driving against fitted inertia torque, one point per window; what is left; delay scan."""
    figure = make_subplots([0.64, 0.36], [0.62, 0.38], gaps=(0.12, 0.2), tall=[(1, 2)])
    names = np.asarray(fit.stretch)
    for stretch, (label, colour) in _STRETCHES.items():
        inside = names == stretch
        if inside.any():
            points = {
                "mode": "markers",
                "name": label,
                "legendgroup": stretch,
                "marker": {"color": colour, "size": 6, "opacity": 0.7},
            }
            drive, inertia = fit.drive[inside], fit.inertia_torque[inside]
            figure.add_scatter(x=inertia, y=drive, **points, row=1, col=1)
            left = drive - inertia
            figure.add_scatter(x=fit.time[inside], y=left, **points, showlegend=False, row=2, col=1)
    both = np.concatenate((fit.inertia_torque, fit.drive))
    ends = [float(both.min()), float(both.max())]
    line = {"color": FITTED, "width": 1.6}
    figure.add_scatter(x=ends, y=ends, mode="lines", name="balance", line=line, row=1, col=1)
    figure.merge_layout(
        **make_layout(560),
        xaxis=make_axis("inertia torque Σ J·ω′, window mean [Nm]"),
        yaxis=make_axis("η·T_e − T_o/i,<br>window mean [Nm]"),
        xaxis3=make_axis("time [s]"),
        yaxis3=make_axis("difference [Nm]"),
    )
    _add_scan(figure, fit)
    return figure


def _add_scan(figure: Figure, fit: MomentumFit) -> None:
    scan = fit.scan
    shown = np.ones(scan.delay.size, dtype=bool)
    if scan.best is not None:
        shown = np.abs(scan.delay - scan.best) <= _SCAN_VIEW
    figure.merge_layout(
        xaxis2=make_axis("assumed delay of T_e [ms]"),
        yaxis2=make_axis("misfit Q − min Q [–]", rangemode="tozero"),
    )
    figure.add_scatter(
        x=1e3 * scan.delay[shown],
        y=(scan.q - scan.q.min())[shown],
        mode="lines+markers",
        name="delay scan",
        showlegend=False,
        line={"color": MEASURED},
        row=1,
        col=2,
    )
    if scan.best is not None:
        figure.add_vline(x=1e3 * scan.best, line={"color": FITTED, "width": 1.6}, row=1, col=2)


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
    """Measured output torque with the extremes read from it, or with the fit and its residual."""
    panels = _build_ringdown_panels(ring)
    if not ring.extremes_time.size:
        return plot_over_time_axis(panels, compute_full_range(panels), 460)
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


def _build_ringdown_panels(ring: RingDown) -> list[Panel]:
    """The curves over time that `plot_ringdown` shows, from top to bottom."""
    measured = Curve("measured", ring.time, ring.torque, MEASURED, 1.1)
    if ring.extremes_time.size:
        return [Panel("output torque", NM, [measured])]
    fitted = Curve("fitted", ring.time, ring.fitted, FITTED, 1.8)
    left = Curve("measured − fitted", ring.time, ring.torque - ring.fitted, MUTED, 1.0)
    return [Panel("output torque", NM, [measured, fitted], 2.6), Panel("residual", NM, [left])]
