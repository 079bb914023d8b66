# SPDX-License-Identifier: MIT
"""Torque balance behind the output shaft (eq. 11) in momentum form: its windows and the line."""

from __future__ import annotations

import numpy as np

from drivetwin.estimation.linear.load_balance import LoadFit
from drivetwin.report.figure import Figure
from drivetwin.report.style import FITTED, MEASURED, make_axis, make_layout


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
