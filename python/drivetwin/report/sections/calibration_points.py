# SPDX-License-Identifier: MIT
"""Sections on the front and the map of a calibration."""

from __future__ import annotations

from drivetwin.calibration.certificate import LimitState
from drivetwin.calibration.front import Front
from drivetwin.calibration.metrics import METRICS, Metric
from drivetwin.calibration.operating_map import MapPoint, OperatingMap
from drivetwin.report.figure import Figure, make_trace
from drivetwin.report.sections.blocks import (
    Block,
    Cell,
    FigureBlock,
    Section,
    TableBlock,
    Tone,
    make_cells,
)
from drivetwin.report.style import SIMULATED, make_axis, make_layout

_RPM = 9.549297
"""1 rad/s in rpm."""


def build_front_section(front: Front | None) -> Section:
    """Figure and table of the front; without a front no blocks."""
    blocks: list[Block] = []
    if front is not None:
        caption = "Points that no other one dominates; the label is the mean friction energy in kJ."
        blocks = [FigureBlock(plot_front(front), caption), _build_front_table(front)]
    return Section(
        "front",
        "Comfort, energy and time",
        "Calibrations with other limits of shift time and friction energy, each polished from its "
        "neighbour: other solutions far from this one are not searched. Fresh draws.",
        blocks,
    )


def plot_front(front: Front) -> Figure:
    """Peak jerk over shift time, both for 95 % of the units, labelled with the energy in kJ."""
    figure = Figure(
        make_trace(
            "scatter",
            x=[one.time for one in front.points],
            y=[one.jerk for one in front.points],
            text=[f"{1e-3 * one.energy:.0f}" for one in front.points],
            mode="markers+text",
            textposition="top center",
            marker={"color": SIMULATED, "size": 9},
            showlegend=False,
        )
    )
    axes = {"xaxis": make_axis("shift time [s]"), "yaxis": make_axis("peak jerk [m/s³]")}
    figure.set_layout(make_layout(380, **axes))
    return figure


def _build_front_table(front: Front) -> TableBlock:
    head = (*make_cells("moved limit"), *make_cells("shift time, 95 % [s]",
            "peak jerk, 95 % [m/s³]", "mean friction energy [kJ]", number=True))  # fmt: skip
    rows = []
    for one in front.points:
        texts = f"{one.time:.3f}", f"{one.jerk:.1f}", f"{1e-3 * one.energy:.1f}"
        rows.append((Cell(one.arm.value), *make_cells(*texts, number=True)))
    return TableBlock(f"{len(front.points)} of {front.tried} calibrations", head, rows)


def build_map_section(mapped: OperatingMap | None) -> Section:
    """Tables of the grid points and of the centres between them; without a map no blocks."""
    blocks: list[Block] = []
    if mapped is not None:
        points = [mapped.points[place] for place in sorted(mapped.points)]
        blocks = [
            _build_map_table("Grid points", points),
            _build_map_table("Centres of the cells, by interpolation", mapped.between),
        ]
    return Section(
        "map",
        "Map over the operating points",
        "Each point is polished from its neighbour. Values between the points are linear in torque "
        "and speed. Fresh draws.",
        blocks,
    )


def _build_map_table(caption: str, points: tuple[MapPoint, ...] | list[MapPoint]) -> TableBlock:
    numbers = ("engine torque [Nm]", "engine speed [rpm]", "peak jerk, 95 % [m/s³]",
               "shift time, 95 % [s]", "mean friction energy [kJ]")  # fmt: skip
    head = (*make_cells(*numbers, number=True), Cell("limits"))
    return TableBlock(caption, head, [_build_map_row(one) for one in points])


def _build_map_row(one: MapPoint) -> tuple[Cell, ...]:
    point, certificate = one.task.maneuver.point, one.found.certificate
    energy = certificate.quantiles[Metric.FRICTION_ENERGY].mean
    texts = (
        f"{point.engine_torque:.0f}",
        f"{point.engine_speed * _RPM:.0f}",
        f"{one.jerk:.1f}",
        f"{certificate.quantiles[Metric.SHIFT_TIME].share_95:.3f}",
        f"{1e-3 * energy:.1f}",
    )
    exceeded = [each for each in certificate.limits if each.state is LimitState.EXCEEDED]
    named = ", ".join(METRICS[each.limit.metric].label for each in exceeded)
    state = Cell(f"exceeds {named}", tone=Tone.DOUBTFUL) if exceeded else Cell("kept")
    return (*make_cells(*texts, number=True), state)
