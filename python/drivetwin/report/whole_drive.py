# SPDX-License-Identifier: MIT
"""Shift quality of a whole drive as one HTML page that opens offline."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from drivetwin._util.display_units import format_significant, get_display_unit
from drivetwin.report.blocks import Column, FigureBlock, Section, TableBlock, make_table
from drivetwin.report.figure import Figure
from drivetwin.report.html import render_page
from drivetwin.report.style import get_candidate_style, make_axis, make_layout
from drivetwin.shifts.quality import QUALITY_UNITS
from drivetwin.shifts.shift import Shift
from drivetwin.shifts.summary import SUMMARIZED, ShiftGroup, summarize_shifts
from drivetwin.vehicle.shift_kind import ShiftKind

_BESIDE = 3
"""So many shifts beside each other in a table."""


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
    for name, table in build_summary_tables(groups).items():
        label = _get_label(name)
        figure = FigureBlock(plot_quality(name, shifts), f"{label} of each shift.")
        text = "The spread is the standard deviation between the shifts, the worst is the largest."
        yield Section(name, label, text, [figure, table])


def _get_label(name: str) -> str:
    return name.replace("_", " ").capitalize()


def build_summary_tables(groups: Sequence[ShiftGroup]) -> dict[str, TableBlock]:
    """Build one table for each figure of shift quality, by name: statistics by kind and gears."""
    columns = (
        *("kind", "gears"),
        *(("shifts", "d"), ("mean", "3"), ("spread", "s"), ("worst", "3"), ("at s", "z.2f")),
    )
    tables = {}
    for name in SUMMARIZED:
        display = get_display_unit(QUALITY_UNITS[name])
        rows = []
        for group in groups:
            if (one := group.figures.get(name)) is None:
                continue
            spread = (
                "" if one.spread is None else format_significant(display.factor * one.spread, 3)
            )
            mean, worst = display.factor * one.mean, display.factor * one.worst
            numbers = (one.count, mean, spread, worst, one.worst_time)
            rows.append((group.kind.value, group.gears or "all", *numbers))
        if rows:
            caption = f"{_get_label(name)} by kind of shift, in {display.label}"
            tables[name] = make_table(caption, columns, rows)
    return tables


def build_quality_tables(shifts: Sequence[Shift]) -> Iterator[TableBlock]:
    """Build tables of shift quality, one column for each shift; split if there are many."""
    for first in range(0, len(shifts), _BESIDE):
        part = shifts[first : first + _BESIDE]
        names = [f"{one.start_gear}→{one.end_gear}, {one.lockup_time:z.2f} s" for one in part]
        rows = []
        for figure, unit in QUALITY_UNITS.items():
            if any(figure in one.quality for one in part):
                display = get_display_unit(unit)
                values = (one.quality.get(figure) for one in part)
                scaled = (None if one is None else one * display.factor for one in values)
                rows.append((figure.replace("_", " "), *scaled, display.label))
        columns: Sequence[Column] = ("figure", *((name, "3") for name in names), "unit")
        yield make_table("Shift quality", columns, rows)


def plot_quality(name: str, shifts: Sequence[Shift]) -> Figure:
    """One figure of shift quality over the pairs of gears: a point for each shift.

    Parameters
    ----------
    name : a key of `QUALITY_UNITS`
    shifts : shifts of the drive; those without the figure are left out
    """
    display = get_display_unit(QUALITY_UNITS[name])
    shown = [one for one in shifts if name in one.quality]
    by_gear = sorted(
        shown, key=lambda one: (not one.kind.is_up, len(one.start_gear), one.start_gear)
    )
    order = list(dict.fromkeys(_format_gears(one) for one in by_gear))
    figure = Figure()
    for k, kind in enumerate(one for one in ShiftKind if any(s.kind is one for s in shown)):
        alike = [one for one in shown if one.kind is kind]
        style = get_candidate_style(k)
        figure.add_scatter(
            x=[_format_gears(one) for one in alike],
            y=[display.factor * one.quality[name] for one in alike],
            mode="markers",
            name=kind.value,
            text=[f"{one.lockup_time:.2f} s" for one in alike],
            marker={"color": style.colour, "symbol": style.symbol, "size": 8},
            hovertemplate=f"%{{x}}: %{{y:.3g}} {display.label}, lock-up at %{{text}}"
            f"<extra>{kind.value}</extra>",
        )
    label = name.replace("_", " ")
    figure.set_layout(
        make_layout(
            300,
            xaxis=make_axis("gears", type="category", categoryorder="array", categoryarray=order),
            yaxis=make_axis(f"{label} [{display.label}]", rangemode="tozero"),
            showlegend=True,
        )
    )
    return figure


def _format_gears(shift: Shift) -> str:
    return f"{shift.start_gear}→{shift.end_gear}"
