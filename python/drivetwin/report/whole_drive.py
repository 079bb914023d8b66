# SPDX-License-Identifier: MIT
"""Shift quality of a whole drive as one HTML page that opens offline."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from drivetwin._util.display_units import format_significant, get_display_unit
from drivetwin.report.figures.shift_summary import plot_quality
from drivetwin.report.html import render_page
from drivetwin.report.sections.blocks import Cell, FigureBlock, Section, TableBlock, make_cells
from drivetwin.shifts.quality import QUALITY_UNITS
from drivetwin.shifts.shift import Shift
from drivetwin.shifts.summary import SUMMARIZED, ShiftGroup, summarize_shifts

_TEXTS = ("kind", "gears")
_NUMBERS = ("shifts", "mean", "spread", "worst", "at s")


def render_whole_drive(shifts: Sequence[Shift], log: str) -> str:
    """HTML text of the page: a table and a figure of each summarised figure of shift quality.

    Parameters
    ----------
    shifts : shifts of the drive
    log : name of the log, for the title
    """
    groups = summarize_shifts(shifts)
    return render_page(
        title=f"Shifts of {log}",
        subtitle=f"{len(shifts)} shifts from {shifts[0].lockup_time:z.1f} to "
        f"{shifts[-1].lockup_time:z.1f} s",
        sections=list(_build_sections(shifts, groups)),
    )


def _build_sections(shifts: Sequence[Shift], groups: Sequence[ShiftGroup]) -> Iterator[Section]:
    for name in SUMMARIZED:
        if not any(name in one.figures for one in groups):
            continue
        label = name.replace("_", " ").capitalize()
        yield Section(
            name,
            label,
            "The spread is the standard deviation between the shifts, the worst is the largest.",
            [
                FigureBlock(plot_quality(name, shifts), f"{label} of each shift."),
                _build_table(name, groups),
            ],
        )


def _build_table(name: str, groups: Sequence[ShiftGroup]) -> TableBlock:
    display = get_display_unit(QUALITY_UNITS[name])

    def format_value(value: float | None) -> Cell:
        text = "" if value is None else format_significant(display.factor * value, 3)
        return Cell(text, number=True)

    rows = [
        (
            *make_cells(group.kind.value, group.gears or "all"),
            Cell(str(one.count), number=True),
            *(format_value(value) for value in (one.mean, one.spread, one.worst)),
            Cell(f"{one.worst_time:z.2f}", number=True),
        )
        for group in groups
        if (one := group.figures.get(name)) is not None
    ]
    head = (*make_cells(*_TEXTS), *make_cells(*_NUMBERS, number=True))
    return TableBlock(f"By kind of shift, in {display.label}", head, rows)
