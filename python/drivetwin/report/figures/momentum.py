# SPDX-License-Identifier: MIT
"""Momentum balance of the integral method: its windows, and the scan for the torque's age."""

from __future__ import annotations

import numpy as np

from drivetwin.estimation.linear.momentum_balance import MomentumFit
from drivetwin.report.figure import Figure, make_subplots
from drivetwin.report.style import (
    COMPARED,
    FITTED,
    MEASURED,
    SECOND,
    make_axis,
    make_layout,
)

_STRETCHES = {
    "before": ("gear before the shift", MEASURED),
    "inertia": ("inertia phase", SECOND),
    "after": ("gear after the shift", COMPARED),
}


_SCAN_VIEW = 0.025
"""Ages shown on either side of the best one [s]."""


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
        xaxis2=make_axis("assumed age of T_e [ms]"),
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
