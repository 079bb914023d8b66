# SPDX-License-Identifier: MIT
"""Observed torques as one HTML page that opens offline."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.observer.result import Observation
from drivetwin.report.figures.observer import build_observer_panels
from drivetwin.report.figures.stack import stack_panels
from drivetwin.report.html import render_page
from drivetwin.report.sections.blocks import FigureBlock, NotesBlock, Section
from drivetwin.validation.simulate_log import clip_phases


def render_observations(found: Sequence[Observation], log: ShiftLog) -> str:
    """HTML text of the page; equal observations give equal text."""
    sections = [_build_section(number, one, log) for number, one in enumerate(found, start=1)]
    title = f"Torques observed in {Path(log.source).name}"
    return render_page(title, f"by {found[0].observer}, with 95 % bands", sections)


def _build_section(number: int, one: Observation, log: ShiftLog) -> Section:
    panels = build_observer_panels(one, log)
    phases = clip_phases(one.shift, (float(one.time[0]), float(one.time[-1])))
    figure = stack_panels(panels, phases, height=280 * len(panels))
    blocks: list[FigureBlock | NotesBlock] = [
        FigureBlock(figure, "Each torque with its 95 % band.", panels)
    ]
    if one.notes:
        blocks.append(NotesBlock("Missing in the log", one.notes))
    name = f"Shift {one.shift.start_gear}→{one.shift.end_gear}"
    return Section(f"shift{number}", name, f"A {one.shift.kind}.", blocks)
