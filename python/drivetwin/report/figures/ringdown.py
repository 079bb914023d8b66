# SPDX-License-Identifier: MIT
"""Lock-up oscillation of the output torque and the decaying sine fitted to it (eqs. 12-14)."""

from __future__ import annotations

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from drivetwin.identify.ringdown import RingDown
from drivetwin.report.decimate import envelope
from drivetwin.report.style import FITTED, MEASURED, MUTED, axis, layout


def ringdown_figure(ring: RingDown) -> go.Figure:
    """Measured output torque with the extremes read from it, or with the fit and its residual."""
    return _with_extremes(ring) if ring.extremes_time.size else _with_fit(ring)


def _measured(ring: RingDown) -> go.Scatter:
    time, torque = envelope(ring.time, ring.torque)
    return go.Scatter(x=time, y=torque, name="measured", line={"color": MEASURED, "width": 1.1})


def _with_extremes(ring: RingDown) -> go.Figure:
    figure = go.Figure(_measured(ring))
    figure.add_scatter(
        x=ring.extremes_time,
        y=ring.extremes_torque,
        mode="markers",
        name="extremes of 10 ms means",
        marker={"color": FITTED, "size": 9, "symbol": "circle-open", "line": {"width": 2}},
    )
    figure.update_layout(layout(360, xaxis=axis("time [s]"), yaxis=axis("output torque [Nm]")))
    return figure


def _with_fit(ring: RingDown) -> go.Figure:
    figure = make_subplots(rows=2, shared_xaxes=True, row_heights=[0.72, 0.28])
    figure.add_trace(_measured(ring), row=1, col=1)
    time, fitted = envelope(ring.time, ring.fitted)
    line = {"color": FITTED, "width": 1.8}
    figure.add_scatter(x=time, y=fitted, name="fitted", line=line, row=1, col=1)
    time, left = envelope(ring.time, ring.torque - ring.fitted)
    line = {"color": MUTED, "width": 1}
    figure.add_scatter(x=time, y=left, showlegend=False, line=line, row=2, col=1)
    figure.update_layout(layout(460, hovermode="x"))
    figure.update_layout(
        xaxis=axis("", matches="x2", showticklabels=False),
        xaxis2=axis("time [s]"),
        yaxis=axis("output torque [Nm]"),
        yaxis2=axis("residual<br>[Nm]"),
    )
    return figure
