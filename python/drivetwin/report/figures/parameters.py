# SPDX-License-Identifier: MIT
"""Parameter precision: relative confidence intervals side by side, and correlations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.report.figure import Figure, make_trace
from drivetwin.report.labels import get_parameter_label
from drivetwin.report.style import DIVERGING, MUTED, VERDICT_COLOURS, make_axis, make_layout

_TICKS = [scale * 10.0**power for power in range(-4, 4) for scale in (1.0, 2.0, 5.0)]
"""Labelled values of the logarithmic axis [%]."""


def plot_intervals(estimates: Mapping[str, Estimate]) -> Figure:
    """Half width of the 95 % interval relative to the value, total and noise alone, log axis.

    Parameters without an interval, design values, and times, which may be zero, are left out.
    """
    shown = [
        one
        for one in estimates.values()
        if one.verdict is not Verdict.DESIGN
        and one.unit != "s"
        and compute_half_width_percent(one.value, one.std_total) is not None
    ]
    figure = Figure()
    names = [get_parameter_label(one.id) for one in shown]
    figure.add_scatter(
        y=names,
        x=[compute_half_width_percent(one.value, one.std_total) for one in shown],
        mode="markers",
        name="total: noise and sensor tolerances",
        marker={"color": [VERDICT_COLOURS[one.verdict] for one in shown], "size": 11},
        hovertemplate="%{y}: ±%{x:.2g} %<extra></extra>",
    )
    figure.add_scatter(
        y=names,
        x=[compute_half_width_percent(one.value, one.std_noise) for one in shown],
        mode="markers",
        name="noise alone",
        marker={"color": MUTED, "symbol": "line-ns-open", "size": 12, "line": {"width": 2.5}},
        hovertemplate="%{y}: ±%{x:.2g} % from noise<extra></extra>",
    )
    figure.set_layout(
        make_layout(
            90 + 26 * len(shown),
            xaxis=make_axis(
                "half width of the 95 % interval [% of the value]",
                type="log",
                tickvals=_TICKS,
                ticktext=[f"{tick:g}" for tick in _TICKS],
            ),
            yaxis=make_axis("", autorange="reversed"),
        )
    )
    return figure


def compute_half_width_percent(value: float | None, std: float | None) -> float | None:
    """Return the half width of the 95 % interval in per cent of the value; None if undefined."""
    return 196.0 * abs(std / value) if value and std else None


def plot_correlation(ids: Sequence[str], correlation: FloatArray) -> Figure:
    """Correlation matrix (n, n) of the estimates; pairs near ±1 are hard to separate.

    A fixed parameter has no correlation and is omitted.
    """
    shown = np.count_nonzero(correlation, axis=0) > 1
    ids = [one for one, kept in zip(ids, shown, strict=True) if kept]
    correlation = correlation[np.ix_(shown, shown)]
    names = [get_parameter_label(one) for one in ids]
    figure = Figure(
        make_trace(
            "heatmap",
            x=names,
            y=names,
            z=correlation,
            zmin=-1,
            zmax=1,
            colorscale=DIVERGING,
            showscale=False,
            texttemplate="%{z:.2f}",
        )
    )
    figure.set_layout(
        make_layout(
            140 + 34 * len(ids), xaxis=make_axis(""), yaxis=make_axis("", autorange="reversed")
        )
    )
    return figure
