# SPDX-License-Identifier: MIT
"""Sections on the front and the map of a calibration."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin._util.display_units import RPM
from drivetwin.calibration.certificate import LimitState
from drivetwin.calibration.front import Front
from drivetwin.calibration.metrics import METRICS, Metric
from drivetwin.calibration.operating_map import MapPoint, OperatingMap
from drivetwin.report.blocks import Block, Cell, FigureBlock, Section, TableBlock, Tone, make_table
from drivetwin.report.figure import Figure, make_trace
from drivetwin.report.style import SIMULATED, make_axis, make_layout


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
    rows = [(one.arm.value, one.time, one.jerk, 1e-3 * one.energy) for one in front.points]
    columns = (
        *("moved limit", ("shift time, 95 % [s]", ".3f"), ("peak jerk, 95 % [m/s³]", ".1f")),
        ("mean friction energy [kJ]", ".1f"),
    )
    return make_table(f"{len(front.points)} of {front.tried} calibrations", columns, rows)


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


def _build_map_table(caption: str, points: Sequence[MapPoint]) -> TableBlock:
    columns = (
        *(("engine torque [Nm]", ".0f"), ("engine speed [rpm]", ".0f")),
        *(("peak jerk, 95 % [m/s³]", ".1f"), ("shift time, 95 % [s]", ".3f")),
        *(("mean friction energy [kJ]", ".1f"), "limits"),
    )
    return make_table(caption, columns, [_build_map_row(one) for one in points])


def _build_map_row(one: MapPoint) -> tuple[object, ...]:
    point, certificate = one.task.maneuver.point, one.found.certificate
    exceeded = [each for each in certificate.limits if each.state is LimitState.EXCEEDED]
    named = ", ".join(METRICS[each.limit.metric].label for each in exceeded)
    return (
        *(point.engine_torque, point.engine_speed * RPM.factor, one.jerk),
        certificate.quantiles[Metric.SHIFT_TIME].share_95,
        1e-3 * certificate.quantiles[Metric.FRICTION_ENERGY].mean,
        Cell(f"exceeds {named}", tone=Tone.DOUBTFUL) if exceeded else "kept",
    )
