# SPDX-License-Identifier: MIT
"""Observed torques as one HTML page that opens offline."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from drivetwin._util.display_units import NM
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.observer.linear_model import Band, FloatArray, Observation
from drivetwin.report.blocks import Block, FigureBlock, Page, Section, make_notes, make_table
from drivetwin.report.figure import MEASURED, SIMULATED
from drivetwin.report.figures.stack import Curve, Panel, stack_panels
from drivetwin.validation.simulate_log import clip_phases


def build_observer_page(found: Sequence[Observation], log: ShiftLog) -> Page:
    """Build the page."""
    sections = [_build_section(number, one, log) for number, one in enumerate(found, start=1)]
    title = f"Torques observed in {Path(log.source).name}"
    return Page(title, "from speeds and engine torque, with 95 % bands", sections)


def _build_section(number: int, one: Observation, log: ShiftLog) -> Section:
    panels = build_observer_panels(one, log)
    phases = clip_phases(one.shift, (float(one.time[0]), float(one.time[-1])))
    figure = stack_panels(panels, phases, height=280 * len(panels))
    drawn = FigureBlock(figure, "Each torque with its 95 % band.")
    name = f"Shift {one.shift.name}"
    blocks = [drawn, *build_torque_blocks(one)]
    return Section(f"shift{number}", name, f"A {one.shift.kind}.", blocks)


def build_torque_blocks(one: Observation) -> list[Block]:
    """Table of the torques with the half width of their bands, and what the log lacks."""
    rows = []
    for name, band in one.bands.items():
        half = band.upper - band.value
        rows.append((name, band.value.min(), band.value.max(), half.mean(), half.max()))
    columns = (
        *("torque", ("lowest [Nm]", "z.0f"), ("highest [Nm]", "z.0f")),
        *(("± 95 % [Nm]", "z.1f", "mean"), ("± 95 % [Nm]", "z.1f", "largest")),
    )
    return [
        make_table(f"Shift {one.shift.name}", columns, rows),
        *make_notes("Missing in the log", one.notes),
    ]


BAND_FILL, BAND_EDGE = "rgba(213,94,0,0.28)", "rgba(213,94,0,0.6)"
"""Area and edges of a band, in the colour of the curve within."""


def build_observer_panels(one: Observation, log: ShiftLog) -> list[Panel]:
    """Build a panel for each torque; add the measured output torque if the log has one."""
    panels = []
    for name, band in one.bands.items():
        curves = _build_band_curves(one.time, band)
        if name in log:
            channel = log[name]
            inside = (channel.time >= one.time[0]) & (channel.time <= one.time[-1])
            measured = Curve("measured", channel.time[inside], channel.values[inside], MEASURED)
            curves = [measured, *curves]
        panels.append(Panel(name.replace("_", " ").replace(".", " of "), NM, curves))
    return panels


def _build_band_curves(time: FloatArray, band: Band) -> list[Curve]:
    name, edge = "95 % band", BAND_EDGE
    return [
        Curve(name, time, band.lower, edge, width=0.7, listed=False, says="from"),
        Curve(name, time, band.upper, edge, width=0.7, fill=BAND_FILL, says="to"),
        Curve("observed", time, band.value, SIMULATED, width=1.6),
    ]
