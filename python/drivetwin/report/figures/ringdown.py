# SPDX-License-Identifier: MIT
"""Lock-up oscillation of the output torque and the decaying sine fitted to it (eqs. 12-14)."""

from __future__ import annotations

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from drivetwin.identify.ringdown import RingDown
from drivetwin.report.decimate import envelope
from drivetwin.report.style import FITTED, MEASURED, MUTED, axis, layout


def ringdown_figure(ring: RingDown) -> go.Figure:
    """Measured output torque with fit or extremes above, what the fit leaves below."""
    figure = make_subplots(rows=2, shared_xaxes=True, row_heights=[0.72, 0.28])
    time, torque = envelope(ring.time, ring.torque)
    figure.add_scatter(
        x=time, y=torque, name="measured", line={"color": MEASURED, "width": 1.1}, row=1, col=1
    )
    figure.update_layout(layout(460))
    figure.update_layout(
        xaxis=axis(""),
        xaxis2=axis("time [s]"),
        yaxis=axis("output torque [Nm]"),
        yaxis2=axis("residual<br>[Nm]"),
        hovermode="x",
    )
    if ring.extremes_time.size:
        figure.add_scatter(
            x=ring.extremes_time,
            y=ring.extremes_torque,
            mode="markers",
            name="extremes",
            marker={"color": FITTED, "size": 9, "symbol": "circle-open", "line": {"width": 2}},
            row=1,
            col=1,
        )
        return figure
    time, fitted = envelope(ring.time, ring.fitted)
    figure.add_scatter(
        x=time, y=fitted, name="fitted", line={"color": FITTED, "width": 1.8}, row=1, col=1
    )
    time, left = envelope(ring.time, ring.torque - ring.fitted)
    figure.add_scatter(
        x=time,
        y=left,
        name="measured − fitted",
        showlegend=False,
        line={"color": MUTED, "width": 1},
        row=2,
        col=1,
    )
    return figure
