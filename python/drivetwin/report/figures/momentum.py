# SPDX-License-Identifier: MIT
"""Momentum balance of the integral method: its windows, and the scan for the torque's age."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from drivetwin.identify.momentum import MomentumFit
from drivetwin.report.style import COMPARED, FITTED, MEASURED, SECOND, axis, layout

_STRETCHES = {
    "before": ("gear before the shift", MEASURED),
    "inertia": ("inertia phase", SECOND),
    "after": ("gear after the shift", COMPARED),
}


def momentum_figure(fit: MomentumFit) -> go.Figure:
    """Driving torque against fitted inertia torque, one point per window; Q over the age beside."""
    figure = make_subplots(cols=2, column_widths=[0.62, 0.38], horizontal_spacing=0.12)
    names = np.asarray(fit.stretch)
    for stretch, (label, colour) in _STRETCHES.items():
        inside = names == stretch
        if inside.any():
            figure.add_scatter(
                x=fit.inertia_torque[inside],
                y=fit.drive[inside],
                mode="markers",
                name=label,
                marker={"color": colour, "size": 6, "opacity": 0.7},
                row=1,
                col=1,
            )
    both = np.concatenate((fit.inertia_torque, fit.drive))
    ends = [float(both.min()), float(both.max())]
    figure.add_scatter(
        x=ends,
        y=ends,
        mode="lines",
        name="balance",
        line={"color": FITTED, "width": 1.8},
        row=1,
        col=1,
    )
    figure.update_layout(layout(430))
    figure.update_layout(
        xaxis=axis("inertia torque Σ J·ω′, window mean [Nm]"),
        yaxis=axis("driving torque η·T_e − T_o/i, window mean [Nm]"),
    )
    _add_scan(figure, fit)
    return figure


def _add_scan(figure: go.Figure, fit: MomentumFit) -> None:
    figure.update_layout(
        xaxis2=axis("assumed age of the engine torque [ms]"),
        yaxis2=axis("misfit Q − min Q [–]", rangemode="tozero"),
    )
    if fit.scan is None:
        return
    figure.add_scatter(
        x=1e3 * fit.scan.delay,
        y=fit.scan.q - fit.scan.q.min(),
        mode="lines+markers",
        name="delay scan",
        showlegend=False,
        line={"color": MEASURED},
        row=1,
        col=2,
    )
    if fit.scan.best is not None:
        figure.add_vline(x=1e3 * fit.scan.best, line={"color": FITTED, "width": 1.6}, row=1, col=2)
