# SPDX-License-Identifier: MIT
"""Lock-up oscillation of the output torque and the decaying sine fitted to it (eqs. 12-14)."""

from __future__ import annotations

from drivetwin._util.display_units import NM
from drivetwin.estimation.linear.ringdown import RingDown
from drivetwin.report.figure import Figure
from drivetwin.report.figures.stack import Curve, Panel, compute_full_range, plot_over_time_axis
from drivetwin.report.style import FITTED, MEASURED, MUTED


def plot_ringdown(ring: RingDown) -> Figure:
    """Measured output torque with the extremes read from it, or with the fit and its residual."""
    panels = build_ringdown_panels(ring)
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


def build_ringdown_panels(ring: RingDown) -> list[Panel]:
    """The curves over time that `plot_ringdown` shows, from top to bottom."""
    measured = Curve("measured", ring.time, ring.torque, MEASURED, 1.1)
    if ring.extremes_time.size:
        return [Panel("output torque", NM, [measured])]
    fitted = Curve("fitted", ring.time, ring.fitted, FITTED, 1.8)
    left = Curve("measured − fitted", ring.time, ring.torque - ring.fitted, MUTED, 1.0)
    return [Panel("output torque", NM, [measured, fitted], 2.6), Panel("residual", NM, [left])]
