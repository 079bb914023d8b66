# SPDX-License-Identifier: MIT
"""Pages on the shifts of a log: shift quality of a whole drive, and observed torques."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from drivetwin._util.display_units import NM, format_significant, get_display_unit
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.observer.linear_model import Band, FloatArray, Observation
from drivetwin.report.blocks import (
    Block,
    Cell,
    Column,
    FigureBlock,
    Page,
    Section,
    TableBlock,
    make_notes,
    make_number,
    make_table,
)
from drivetwin.report.figure import (
    MEASURED,
    SIMULATED,
    Figure,
    get_candidate_style,
    make_axis,
    make_layout,
)
from drivetwin.report.stack import Curve, Panel, stack_panels
from drivetwin.report.validation import plot_shift_phases
from drivetwin.shifts.quality import QUALITY_UNITS
from drivetwin.shifts.shift import Shift
from drivetwin.shifts.summary import (
    LEVEL,
    SUMMARIZED,
    FigureComparison,
    ShiftGroup,
    Trend,
    summarize_shifts,
)
from drivetwin.validation.simulate_log import clip_phases
from drivetwin.vehicle.spec import ShiftKind

_BESIDE = 3
"""So many shifts beside each other in a table."""


def build_whole_drive_page(
    shifts: Sequence[Shift], log: ShiftLog, comparison: Sequence[FigureComparison] = ()
) -> Page:
    """Build the page: each summarised figure of shift quality, and outlying shifts.

    Parameters
    ----------
    shifts : shifts of the drive
    log : log of the drive
    comparison : comparison with another drive
    """
    groups = summarize_shifts(shifts)
    sections = list(_build_sections(shifts, groups))
    summaries = [one for group in groups for one in group.figures.values()]
    outlying = {outlier.time for one in summaries for outlier in one.outliers}
    if outlying:
        text = "Shifts of which a figure is an outlier, in their place in the log."
        figures = [
            FigureBlock(plot_shift_phases(log, one), f"{one.name}, {one.kind.value}.")
            for one in shifts
            if one.lockup_time in outlying
        ]
        table = build_outlier_table(groups)
        sections.append(Section(_OUTLIERS, "Outliers", text, [table, *figures]))
    if comparison:
        text = "Shifts of the same kind and gears in both."
        table = build_comparison_table(comparison)
        sections.append(Section("comparison", "Comparison", text, [table]))
    return Page(
        title=f"Shifts of {Path(log.source).name}",
        subtitle=f"{len(shifts)} shifts from {shifts[0].lockup_time:z.1f} to "
        f"{shifts[-1].lockup_time:z.1f} s",
        sections=sections,
    )


def _build_sections(shifts: Sequence[Shift], groups: Sequence[ShiftGroup]) -> Iterator[Section]:
    for name, table in build_summary_tables(groups).items():
        label = _get_label(name)
        figures = [
            FigureBlock(plot_quality(name, shifts), f"{label} of each shift."),
            FigureBlock(plot_quality(name, shifts, over_time=True), f"{label} over the drive."),
        ]
        text = (
            "Outliers are tested by Rosner's generalised Studentized deviate, trends by Kendall's "
            "rank correlation, each at 5 %; trends are corrected for their number."
        )
        yield Section(name, label, text, [figures[0], table, figures[1]])


def _get_label(name: str) -> str:
    return name.replace("_", " ").capitalize()


def get_figure_label(name: str) -> str:
    """Return the label of a figure of shift quality with its display unit."""
    return f"{_get_label(name)} [{get_display_unit(QUALITY_UNITS[name]).label}]"


_HOUR = 3600.0
_OUTLIERS = "outliers"


def build_summary_tables(groups: Sequence[ShiftGroup]) -> dict[str, TableBlock]:
    """Build one table for each figure of shift quality, by name: statistics by kind and gears."""
    columns = (
        *("kind of shift", "gears", ("shifts", "d"), ("median", "3"), ("10..90 %", "s")),
        *(("worst", "3"), make_number("at s", secondary=True)),
        *(("outliers at s", "s"), ("trend per h", "s")),
    )
    tables = {}
    for name in SUMMARIZED:
        display = get_display_unit(QUALITY_UNITS[name])
        rows = []
        for group in groups:
            if (one := group.figures.get(name)) is None:
                continue
            low, high = (format_significant(display.factor * end, 3) for end in (one.low, one.high))
            median, worst = display.factor * one.median, display.factor * one.worst
            when = f"{one.worst_time:z.2f}"
            numbers = (one.count, median, f"{low}..{high}", worst, when)
            times = " ".join(f"{outlier.time:z.2f}" for outlier in one.outliers)
            outliers = Cell(times, number=True, href=f"#{_OUTLIERS}" if times else "")
            trend = _make_trend_cell(one.trend, display.factor)
            rows.append((group.kind.value, group.gears or "all", *numbers, outliers, trend))
        if rows:
            caption = f"{_get_label(name)} by kind of shift, in {display.label}"
            tables[name] = make_table(caption, columns, rows)
    return tables


def build_outlier_table(groups: Sequence[ShiftGroup]) -> TableBlock:
    """Build the table of outlying shifts with the figure that is one."""
    columns = ("figure", "shift", ("lock-up at s", "z.2f"), ("value", "3"), ("median", "3"))
    rows: list[tuple[object, ...]] = []
    for group in groups:
        shift = f"{group.gears}, {group.kind.value}"
        for name, one in group.figures.items():
            display = get_display_unit(QUALITY_UNITS[name])
            label = get_figure_label(name)
            for outlier in one.outliers:
                values = (display.factor * each for each in (outlier.value, one.median))
                rows.append((label, shift, outlier.time, *values))
    return make_table("Outliers", columns, rows)


def _make_trend_cell(trend: Trend | None, factor: float) -> Cell:
    """Make the cell of a slope per hour with its interval; empty where it is not significant."""
    if trend is None or trend.p >= LEVEL:
        return Cell("", number=True)
    ends = (trend.slope, *trend.interval)
    slope, low, high = (format_significant(_HOUR * factor * end, 3) for end in ends)
    return Cell(slope, number=True, note=f"{low}..{high}")


def build_comparison_table(comparison: Sequence[FigureComparison]) -> TableBlock:
    """Build the table of two drives: medians, difference with 95 % interval, verdict."""
    columns = (
        *("figure", "shift", make_number("shifts", secondary=True), ("medians", "s")),
        *(("difference, 95 %", "s"), make_number("p", secondary=True), "verdict"),
    )
    rows = []
    for one in comparison:
        display = get_display_unit(QUALITY_UNITS[one.figure])
        medians = " ".join(format_significant(display.factor * each, 3) for each in one.medians)
        difference, p, verdict = "", "", "too few shifts"
        if one.difference is not None:
            ends = (one.difference.shift, *one.difference.interval)
            middle, low, high = (format_significant(display.factor * each, 2) for each in ends)
            difference, p = f"{middle} ({low}..{high})", f"{one.difference.p:.2g}"
            verdict = "differ" if one.differs else "not shown"
        label = get_figure_label(one.figure)
        counts = " ".join(map(str, one.counts))
        shift = f"{one.gears}, {one.kind.value}"
        rows.append((label, shift, counts, medians, difference, p, verdict))
    caption = "This drive, then the other: rank-sum tests, corrected for their number"
    return make_table(caption, columns, rows)


def build_quality_tables(shifts: Sequence[Shift]) -> Iterator[TableBlock]:
    """Build tables of shift quality, one column for each shift; split if there are many."""
    for first in range(0, len(shifts), _BESIDE):
        part = shifts[first : first + _BESIDE]
        names = [f"{one.name}, {one.lockup_time:z.2f} s" for one in part]
        rows = []
        for figure, unit in QUALITY_UNITS.items():
            if any(figure in one.quality for one in part):
                display = get_display_unit(unit)
                values = (one.quality.get(figure) for one in part)
                scaled = (None if one is None else one * display.factor for one in values)
                rows.append((figure.replace("_", " "), *scaled, display.label))
        columns: Sequence[Column] = ("figure", *((name, "3") for name in names), "unit")
        yield make_table("Shift quality", columns, rows)


def plot_quality(name: str, shifts: Sequence[Shift], *, over_time: bool = False) -> Figure:
    """One figure of shift quality over the pairs of gears or over time: a point for each shift.

    Parameters
    ----------
    name : a key of `QUALITY_UNITS`
    shifts : shifts of the drive; those without the figure are left out
    over_time : the axis is the time of lock-up
    """
    display = get_display_unit(QUALITY_UNITS[name])
    shown = [one for one in shifts if name in one.quality]
    by_gear = sorted(
        shown, key=lambda one: (not one.kind.is_up, len(one.start_gear), one.start_gear)
    )
    order = list(dict.fromkeys(one.name for one in by_gear))
    figure = Figure()
    for k, kind in enumerate(one for one in ShiftKind if any(s.kind is one for s in shown)):
        alike = [one for one in shown if one.kind is kind]
        style = get_candidate_style(k)
        figure.add_scatter(
            x=[one.lockup_time if over_time else one.name for one in alike],
            y=[display.factor * one.quality[name] for one in alike],
            mode="markers",
            name=kind.value,
            text=[f"{one.name} at {one.lockup_time:.2f} s" for one in alike],
            marker={"color": style.colour, "symbol": style.symbol, "size": 8},
            hovertemplate=f"%{{text}}: %{{y:.3g}} {display.label}<extra>{kind.value}</extra>",
        )
    label = name.replace("_", " ")
    axis = make_axis("gears", type="category", categoryorder="array", categoryarray=order)
    figure.set_layout(
        make_layout(
            300,
            xaxis=make_axis("lock-up [s]") if over_time else axis,
            yaxis=make_axis(f"{label} [{display.label}]", rangemode="tozero"),
            showlegend=True,
        )
    )
    return figure


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
