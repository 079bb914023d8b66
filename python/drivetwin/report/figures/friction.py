# SPDX-License-Identifier: MIT
"""Friction coefficient over slip with its 95 % band and the points behind it (paper Fig. 8, 9)."""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetwin.estimation.result.estimate import FrictionCurve
from drivetwin.report.figure import Entry, Figure, make_trace
from drivetwin.report.figures.stack import MAX_POINTS
from drivetwin.report.style import BAND, COMPARED, FITTED, MEASURED, make_axis, make_layout


def plot_friction(element: str, curve: FrictionCurve) -> Figure:
    """Points, smoothed curve with band, and the fitted Stribeck law of one element."""
    figure = Figure()
    if curve.points_slip.size:
        stride = -(-curve.points_slip.size // MAX_POINTS)
        figure.add_scatter(
            x=curve.points_slip[::stride].astype("float32"),
            y=curve.points_mu[::stride].astype("float32"),
            mode="markers",
            name="points from the log",
            marker={"color": MEASURED, "size": 4, "opacity": 0.45},
        )
    bounds = draw_band(curve, BAND, name="95 % band, sensors and effects")
    if len(bounds.x):
        figure.add_trace(bounds)
    figure.add_scatter(
        x=curve.slip,
        y=curve.mu,
        mode="lines",
        name=f"curve of {element}",
        line={"color": FITTED, "width": 2.2},
    )
    if curve.stribeck is not None:
        figure.add_scatter(
            x=curve.slip,
            y=curve.stribeck.evaluate(curve.slip),
            mode="lines",
            name="Stribeck law",
            line={"color": COMPARED, "width": 1.6, "dash": "dash"},
        )
    figure.set_layout(
        make_layout(
            420,
            xaxis=make_axis(f"|slip| of {element} [rad/s]", rangemode="tozero"),
            yaxis=make_axis(
                f"friction coefficient {curve.symbol} [–]", range=_compute_mu_range(curve)
            ),
            hovermode="x",
        )
    )
    return figure


def draw_band(curve: FrictionCurve, colour: str, **options: Any) -> Entry:
    """Area between the bounds of a curve; empty if the curve has no bounds."""
    known = np.isfinite(curve.mu_lo) & np.isfinite(curve.mu_hi)
    slip = curve.slip[known]
    return make_trace(
        "scatter",
        x=np.concatenate((slip, slip[::-1])),
        y=np.concatenate((curve.mu_hi[known], curve.mu_lo[known][::-1])),
        mode="lines",
        fill="toself",
        fillcolor=colour,
        line={"width": 0},
        hoverinfo="skip",
        **options,
    )


def _compute_mu_range(curve: FrictionCurve) -> tuple[float, float]:
    """Range that shows curve and band whole; stray points at vanishing pressure may lie outside."""
    values = np.concatenate((curve.mu, curve.mu_lo, curve.mu_hi))
    values = values[np.isfinite(values)]
    middle = curve.points_mu[np.isfinite(curve.points_mu)]
    if middle.size:
        values = np.concatenate((values, np.percentile(middle, [10, 90])))
    low, high = float(values.min()), float(values.max())
    margin = 0.15 * (high - low) + 0.002
    return low - margin, high + margin
