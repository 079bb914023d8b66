# SPDX-License-Identifier: MIT
"""Evidence of the paper's method, stage by stage."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from drivetwin._util.display_units import NM
from drivetwin.estimation.direct.ringdown import RingDown
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.paper.pipeline import GridFit, PaperShift
from drivetwin.findings import render
from drivetwin.report.blocks import (
    Block,
    FigureBlock,
    Section,
    TableBlock,
    Tone,
    make_badge,
    make_notes,
    make_table,
)
from drivetwin.report.figure import (
    COMPARED,
    FITTED,
    MEASURED,
    MUTED,
    Figure,
    make_axis,
    make_layout,
    make_subplots,
)
from drivetwin.report.stack import Curve, Panel, compute_full_range, plot_over_time_axis
from drivetwin.shifts.shift import make_shift_labels


@dataclass(frozen=True)
class WlseLabels:
    """Texts of one grid search; `unit` is that of the grid value."""

    grid: str
    unit: str
    acceleration: str
    torque: str
    inertia: str


def plot_wlse(fit: GridFit, labels: WlseLabels) -> Figure:
    """Scatter with the fitted line at the best grid value; RMS error over the grid next to it."""
    figure = make_subplots([0.62, 0.38], gaps=(0.12, 0.0))
    first = fit.rows[0].value
    inside = fit.weights >= 1.0
    groups = (
        (f"{labels.grid} = {first:g}", fit.torque_start, np.ones_like(inside), MUTED, 0.3),
        ("implausible quotient, weight 0.01", fit.torque, ~inside, COMPARED, 0.35),
        (f"{labels.grid} = {fit.best.value:g}, weight 1", fit.torque, inside, MEASURED, 0.7),
    )
    for name, torque, kept, colour, opacity in groups:
        figure.add_scatter(
            x=fit.acceleration[kept].astype("float32"),
            y=torque[kept].astype("float32"),
            mode="markers",
            name=name,
            marker={"color": colour, "size": 5, "opacity": opacity},
            row=1,
            col=1,
        )
    ends = np.array(
        [min(0.0, float(fit.acceleration.min())), max(0.0, float(fit.acceleration.max()))]
    )
    figure.add_scatter(
        x=ends,
        y=ends * _compute_slope(fit),
        mode="lines",
        name=f"{labels.inertia} = {fit.best.inertia:.4g} kg·m²",
        line={"color": FITTED, "width": 2},
        row=1,
        col=1,
    )
    figure.add_scatter(
        x=[row.value for row in fit.rows],
        y=[row.rmse for row in fit.rows],
        mode="lines+markers",
        name="RMS error",
        showlegend=False,
        line={"color": MEASURED},
        row=1,
        col=2,
    )
    figure.add_scatter(
        x=[fit.best.value],
        y=[fit.best.rmse],
        mode="markers",
        name="least error",
        showlegend=False,
        marker={"color": FITTED, "size": 11, "symbol": "diamond"},
        row=1,
        col=2,
    )
    figure.merge_layout(
        **make_layout(430),
        xaxis=make_axis(labels.acceleration),
        yaxis=make_axis(labels.torque),
        xaxis2=make_axis(f"{labels.grid} [{labels.unit}]"),
        yaxis2=make_axis("RMS error at the output shaft [Nm]", rangemode="tozero"),
    )
    return figure


def _compute_slope(fit: GridFit) -> float:
    """Weighted least-squares slope of the scatter: J′ for eq. 10, J3/i_f for eq. 11."""
    normal = float(fit.weights @ fit.acceleration**2)
    return float(fit.weights @ (fit.acceleration * fit.torque)) / normal


def plot_ringdown(ring: RingDown) -> Figure:
    """Measured output torque with the extremes read from it."""
    measured = Curve("measured", ring.time, ring.torque, MEASURED, 1.1)
    panels = [Panel("output torque", NM, [measured])]
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


INERTIA_LABELS = WlseLabels(
    grid="η",
    unit="–",
    acceleration="engine acceleration ω_e′ [rad/s²]",
    torque="η·T_e − T_o/i [Nm]",
    inertia="J′",
)
LOAD_LABELS = WlseLabels(
    grid="T_v/i_f",
    unit="Nm",
    acceleration="wheel acceleration ω_w′ [rad/s²]",
    torque="T_o − T_v/i_f [Nm]",
    inertia="J3",
)


_Stages = tuple[str, PaperShift]
"""The paper's stages on one shift, after the method and, of several shifts, the shift's name."""


def build_stage_sections(found: Identification) -> list[Section]:
    """Evidence of the paper's method by question: inertia and efficiency, load, output shaft."""
    paper = _collect_stages(found)
    return [
        Section(
            "inertia",
            "Inertia and efficiency",
            "Eq. 10: η·T_e − T_o/i = J′·ω_e′. Points on the line mean that torque and acceleration "
            "agree with one η and one J′.",
            [b for one in paper for b in _build_grid_blocks(one, "inertia", "eta", INERTIA_LABELS)],
        ),
        Section(
            "load",
            "Load and vehicle inertia",
            "Eq. 11: T_o − T_v/i_f = (J3/i_f)·ω_w′, J3 being J_vehicle.",
            [b for one in paper for b in _build_grid_blocks(one, "load", "J_vehicle", LOAD_LABELS)],
        ),
        Section(
            "shaft",
            "Output shaft from the lock-up oscillation",
            "After lock-up the inertias on both sides of the output shaft swing against each "
            "other; frequency and decay give stiffness and damping (eqs. 12–14).",
            [*_build_ring_blocks(paper), *_list_refusals(paper, "shaft")],
        ),
    ]


def _collect_stages(found: Identification) -> list[_Stages]:
    """Collect the stages of the paper's method, with the shift names if there are several."""
    stages = found.evidence.paper
    names = [f"Shift {name}, the paper's method" for name in make_shift_labels(found.shifts)]
    if len(stages) < 2 or len(stages) != len(names):
        names = ["The paper's method"] * len(stages)
    return list(zip(names, stages, strict=True))


def _build_grid_blocks(one: _Stages, stage: str, parameter: str, labels: WlseLabels) -> list[Block]:
    """Build figure and table of a grid search, with any doubt about it between the two."""
    by, stages = one
    fit: GridFit = getattr(stages, stage)
    doubt = render(stages.doubts.get(parameter, ()))
    text = (
        f"{by}, weighted least squares (Fig. 6): samples whose own quotient lies in the "
        "plausible range weigh 1, others 0.01; the grid value of least RMS error is kept. Noise "
        "in the differenced speed biases it."
    )
    notes = make_notes("Not to be relied on", doubt, Tone.DOUBTFUL)
    table = build_grid_table(fit, labels, Tone.DOUBTFUL if doubt else Tone.GOOD)
    return [FigureBlock(plot_wlse(fit, labels), text), *notes, table]


def build_grid_table(fit: GridFit, labels: WlseLabels, tone: Tone = Tone.GOOD) -> TableBlock:
    """The grid as in the paper's Table 1; the row of least error is marked in `tone`."""
    columns = (
        (f"{labels.grid} [{labels.unit}]", "g"),
        (f"{labels.inertia} [kg·m²]", "4"),
        ("RMS error [Nm]", "4"),
        "",
    )
    rows = (
        (
            *(row.value, row.inertia, row.rmse),
            make_badge("least error", tone) if row == fit.best else "",
        )
        for row in fit.rows
    )
    caption = "Grid search as in Table 1, RMS error at the output shaft."
    return make_table(caption, columns, rows)


def _build_ring_blocks(shifts: Iterable[_Stages]) -> list[Block]:
    blocks: list[Block] = []
    for by, stages in shifts:
        ring = stages.ring
        if ring is None:
            continue
        text = (
            f"{by}: {ring.f_d:.3f} Hz, damping ratio {ring.zeta:.4f}, read from the extremes "
            "of the averaged curve."
        )
        blocks.append(FigureBlock(plot_ringdown(ring), text))
    return blocks


def _list_refusals(shifts: Iterable[_Stages], stage: str) -> list[Block]:
    texts = [f"{by}: {one.refusals[stage]}" for by, one in shifts if stage in one.refusals]
    return make_notes("Not possible here", texts, Tone.DOUBTFUL)
