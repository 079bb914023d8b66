# SPDX-License-Identifier: MIT
"""Several identifications side by side: parameters, friction, simulations of one log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from drivetwin.estimation.result.estimate import Z95, FrictionCurve
from drivetwin.report.figure import Figure, make_trace
from drivetwin.report.figures.stack import Curve, Panel, stack_panels
from drivetwin.report.figures.validation import OUTPUTS, draw_band
from drivetwin.report.find_reports import Agreement, Trial
from drivetwin.report.style import (
    MUTED,
    get_candidate_style,
    get_estimate_label,
    make_axis,
    make_layout,
)

_ROW = 0.7
"""Share of the height of a row that the candidates of one parameter take up."""


def plot_agreement(names: Sequence[str], found: Sequence[Agreement]) -> Figure:
    """Deviation of each candidate from the common mean, with 95 % intervals, by parameter.

    In standard deviations of the parameter (the median of the candidates'), so that narrow and wide
    ones read alike. Parameters that cannot be judged are left out; `names` are the candidates'.
    """
    shown = [one for one in found if one.apart is not None]
    figure = Figure()
    for k, name in enumerate(names):
        style = get_candidate_style(k)
        points = [
            (row + _ROW * ((k + 0.5) / len(names) - 0.5), *_standardise(one, k), one)
            for row, one in enumerate(shown)
            if (estimate := one.estimates[k]) is not None and estimate.value is not None
        ]
        figure.add_scatter(
            x=[deviation for _, deviation, _, _ in points],
            y=[row for row, _, _, _ in points],
            error_x={
                "array": [half for _, _, half, _ in points],
                "thickness": 1.6,
                "width": 4,
                "color": style.colour,
            },
            mode="markers",
            name=name,
            text=[get_estimate_label(one.known) for _, _, _, one in points],
            marker={"color": style.colour, "symbol": style.symbol, "size": 9},
            hovertemplate="%{text}: %{x:+.2f} σ<extra>" + name + "</extra>",
        )
    ticks = {
        "tickvals": list(range(len(shown))),
        "ticktext": [get_estimate_label(one.known) for one in shown],
        "range": [len(shown) - 0.4, -0.6],
    }
    figure.set_layout(
        make_layout(
            120 + (18 + 12 * len(names)) * len(shown),
            xaxis=make_axis("deviation from the common mean, with 95 % interval [σ]"),
            yaxis=make_axis("", **ticks),
        )
    )
    figure.add_vline(x=0.0, line={"color": "rgba(128,128,128,0.7)", "width": 1})
    return figure


def _standardise(one: Agreement, k: int) -> tuple[float, float]:
    """Deviation of the `k`-th value from the mean and its 95 % half width, over the median σ."""
    stds = [each.std_total for each in one.estimates if each is not None and each.std_total]
    unit = float(np.median(stds))
    estimate = one.estimates[k]
    assert estimate is not None
    assert estimate.value is not None
    return (estimate.value - one.mean) / unit, Z95 * (estimate.std_total or 0.0) / unit


def plot_friction_overlay(
    element: str, curves: Mapping[str, FrictionCurve], order: Sequence[str]
) -> Figure:
    """μ over slip of one element as each candidate has it, with 95 % bands.

    `curves` by name of the candidate; `order` are all candidates, which gives each its colour.
    """
    figure = Figure()
    for name, curve in curves.items():
        style = get_candidate_style(order.index(name))
        figure.add_trace(draw_band(curve, style.fill, legendgroup=name, showlegend=False))
        figure.add_scatter(
            x=curve.slip,
            y=curve.mu,
            mode="lines",
            name=f"{name} ({curve.symbol})" if curve.over_eta else name,
            legendgroup=name,
            line={"color": style.colour, "width": 2.0, "dash": style.dash},
        )
    figure.set_layout(
        make_layout(
            400,
            xaxis=make_axis(f"|slip| of {element} [rad/s]", rangemode="tozero"),
            yaxis=make_axis("friction coefficient μ [–]"),
            hovermode="x",
        )
    )
    return figure


def plot_trial(trial: Trial, order: Sequence[str]) -> Figure:
    """One shift as measured and as each candidate simulates it, residuals below.

    `order` lists all candidates.
    """
    first = next(iter(trial.runs.values()))
    panels = []
    for name, (title, display, weight) in OUTPUTS.items():
        if name not in first.all_traces:
            continue
        seen = first.all_traces[name]
        over = [Curve("measured", seen.time, seen.measured, MUTED, width=1.0)]
        left = []
        for candidate, run in trial.runs.items():
            if name not in run.all_traces:
                continue
            trace, style = run.all_traces[name], get_candidate_style(order.index(candidate))
            over.append(
                Curve(candidate, trace.time, trace.simulated, style.colour, 1.3, style.dash)
            )
            difference = trace.measured - trace.simulated
            left.append(Curve(candidate, trace.time, difference, style.colour, 1.0, listed=False))
        panels += [Panel(title, display, over, weight), Panel("residual", display, left, 0.7)]
    return stack_panels(panels, first.phases, height=140 + 170 * len(panels))


def plot_fit_matrix(
    rows: Sequence[str], columns: Sequence[str], percent: Sequence[Sequence[float | None]]
) -> Figure:
    """Fit [%] of the output torque: candidates over the logs that they simulate."""
    figure = Figure(
        make_trace(
            "heatmap",
            x=list(columns),
            y=list(rows),
            z=[[np.nan if value is None else value for value in row] for row in percent],
            text=[["–" if value is None else f"{value:z.1f}" for value in row] for row in percent],
            texttemplate="%{text}",
            zmin=0.0,
            zmax=100.0,
            colorscale=[[0.0, "#f4f4f4"], [1.0, "#0072B2"]],
            showscale=False,
            hovertemplate="%{y} on %{x}: %{text} %<extra></extra>",
        )
    )
    figure.set_layout(
        make_layout(
            130 + 34 * len(rows),
            xaxis=make_axis("log and shift", ticks="", side="top"),
            yaxis=make_axis("", ticks="", autorange="reversed"),
        )
    )
    return figure
