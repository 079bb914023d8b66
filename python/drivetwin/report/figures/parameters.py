# SPDX-License-Identifier: MIT
"""How narrowly each parameter is known: relative intervals side by side, and correlations."""

from __future__ import annotations

from collections.abc import Mapping

import plotly.graph_objects as go

from drivetwin.identify.result import Estimate, FloatArray
from drivetwin.report.style import MUTED, VERDICT_COLOURS, axis, layout

_KNOWN = 1e-5
"""Relative standard deviation below which a parameter was given, not found."""


def interval_figure(estimates: Mapping[str, Estimate]) -> go.Figure:
    """Half width of the 95 % interval relative to the value, total and noise alone, log axis.

    Parameters that were not told, or are taken as known, are left out.
    """
    shown = [one for one in estimates.values() if _relative(one.value, one.std_total) > _KNOWN]
    figure = go.Figure()
    names = [one.id for one in shown]
    figure.add_scatter(
        y=names,
        x=[_percent(one.value, one.std_total) for one in shown],
        mode="markers",
        name="total: noise and sensor tolerances",
        marker={"color": [VERDICT_COLOURS[one.verdict.value] for one in shown], "size": 11},
        hovertemplate="%{y}: ±%{x:.2g} %<extra></extra>",
    )
    figure.add_scatter(
        y=names,
        x=[_percent(one.value, one.std_noise) for one in shown],
        mode="markers",
        name="noise alone",
        marker={"color": MUTED, "symbol": "line-ns-open", "size": 12, "line": {"width": 2.5}},
        hovertemplate="%{y}: ±%{x:.2g} % from noise<extra></extra>",
    )
    figure.update_layout(
        layout(
            90 + 26 * len(shown),
            xaxis=axis("half width of the 95 % interval [% of the value]", type="log"),
            yaxis=axis("", autorange="reversed"),
        )
    )
    return figure


def _relative(value: float | None, std: float | None) -> float:
    return abs(std / value) if value and std else 0.0


def _percent(value: float | None, std: float | None) -> float | None:
    return 196.0 * _relative(value, std) or None


def correlation_figure(ids: tuple[str, ...], correlation: FloatArray) -> go.Figure:
    """Correlation matrix (n, n) of the estimates; pairs near ±1 cannot be told apart well."""
    figure = go.Figure(
        go.Heatmap(
            x=ids,
            y=ids,
            z=correlation,
            zmin=-1,
            zmax=1,
            colorscale=[[0, "#D55E00"], [0.5, "#f4f4f4"], [1, "#0072B2"]],
            colorbar={"title": {"text": "correlation"}, "thickness": 12},
            texttemplate="%{z:.2f}",
        )
    )
    figure.update_layout(
        layout(140 + 34 * len(ids), xaxis=axis(""), yaxis=axis("", autorange="reversed"))
    )
    return figure
