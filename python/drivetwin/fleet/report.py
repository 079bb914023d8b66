# SPDX-License-Identifier: MIT
"""Report of a fleet: one page, drawn with the blocks of the report of a log."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from drivetwin._util.display_units import format_significant, format_uncertainty, get_display_unit
from drivetwin.bus.scatter import METHOD as BUS_METHOD
from drivetwin.estimation.result.estimate import Z95, Verdict
from drivetwin.fleet.estimate import estimate_fleet, list_missing_estimates
from drivetwin.fleet.figures import (
    collect_unit_figures,
    compare_units,
    compute_fleet_friction,
    merge_figures,
    plot_drift,
    plot_units,
)
from drivetwin.fleet.identify import LIBRARY
from drivetwin.fleet.mixed import Interval, JointEstimate, Outlier
from drivetwin.fleet.observations import collect_facts, collect_output_fits
from drivetwin.fleet.rules import format_reading, format_span, get_drift_unit
from drivetwin.fleet.store import REPORTS, Store
from drivetwin.fleet.task import RowKind, State
from drivetwin.parameters import get_parameter_spec
from drivetwin.report.blocks import (
    Block,
    Cell,
    Column,
    FigureBlock,
    NotesBlock,
    Page,
    Section,
    TableBlock,
    Tile,
    TilesBlock,
    Tone,
    make_badge,
    make_notes,
    make_number,
    make_tables,
)
from drivetwin.report.figure import get_parameter_label
from drivetwin.report.html import save_page
from drivetwin.report.parameters import TONES, make_parameter_cell
from drivetwin.report.validation import plot_friction
from drivetwin.report.whole_drive import build_comparison_table, get_figure_label
from drivetwin.shifts.quality import QUALITY_UNITS

PAGE = "report.html"


def save_fleet_report(store: Store, path: Path) -> list[JointEstimate]:
    """Estimate jointly and write the page; it appears whole or not at all.

    Within the store it uses the library that the single reports share, where there is one.
    """
    found = estimate_fleet(store)
    shared = store.folder / REPORTS / LIBRARY
    folder = path.absolute().parent
    inside = folder == store.folder and shared.is_file()
    page = build_fleet_page(store, found, folder)
    save_page(path, page, f"{REPORTS}/{LIBRARY}" if inside else None)
    return found


def build_fleet_page(store: Store, found: Sequence[JointEstimate], folder: Path) -> Page:
    """Build the page of a fleet; links are relative to `folder`."""
    sections = [
        _build_overview(store),
        build_vehicle_section(store, folder),
        _build_parameters_section(found, list_missing_estimates(store, found)),
        _build_outlier_section(store, found, folder),
        build_ageing_section(found),
        _build_friction_section(store),
        _build_quality_section(store),
        build_single_logs_section(store, folder),
        _build_failure_section(store),
        _build_settings_section(store),
    ]
    files = _count(store, "SELECT count(*) FROM files")
    units = _count(store, "SELECT count(DISTINCT unit) FROM files")
    return Page(
        f"Fleet of {units} {'unit' if units == 1 else 'units'}",
        f"{files:,} logs in {store.folder.name}",
        sections,
    )


def _count(store: Store, sql: str, *values: object) -> int:
    (row,) = store.index.select(sql, *values)
    return int(row[0])


_STATES = "SELECT count(*) FROM files JOIN logs USING (log) WHERE state = ?"


def _build_overview(store: Store) -> Section:
    counts = {state: _count(store, _STATES, state.value) for state in State}
    failed = counts[State.BAD] + counts[State.QUARANTINED]
    tiles = [
        Tile("logs identified", f"{counts[State.DONE]:,}", Tone.GOOD),
        Tile(
            "logs that failed", f"{failed:,}", Tone.DOUBTFUL if failed else Tone.GOOD,
            f"{counts[State.QUARANTINED]} in quarantine",
        ),
        Tile("shifts used", f"{_count(store, _SHIFTS):,}"),
    ]  # fmt: skip
    if counts[State.WAITING]:
        tiles.append(Tile("logs waiting", f"{counts[State.WAITING]:,}", Tone.DOUBTFUL))
    sql = (
        "SELECT error, count(*) AS n, min(what) FROM files JOIN logs USING (log) "
        "WHERE error != '' GROUP BY error ORDER BY n DESC"
    )
    rows = store.index.select(sql)
    reasons = make_tables("Why logs failed.", ("reason", ("logs", "d"), "for example"), rows)
    intro = "What was there, and what became of it."
    return Section("fleet", "The fleet", intro, [TilesBlock(tiles), *reasons])


_SHIFTS = "SELECT count(*) FROM shifts WHERE state = 'used' AND log IN (SELECT log FROM files)"


def build_estimate_blocks(
    store: Store, found: Sequence[JointEstimate], missing: Sequence[str], folder: Path
) -> list[Block]:
    """Shared values, and what is odd; `folder` is that of the page, to which links are relative."""
    return [
        *_build_parameters_section(found, missing).blocks,
        *_build_outlier_section(store, found, folder).blocks,
    ]


def _build_parameters_section(found: Sequence[JointEstimate], missing: Sequence[str]) -> Section:
    several = _has_several_rules(found)
    per = " or ".join({get_drift_unit(one.drifts[0].field)[1]: 0 for one in found if one.drifts})
    notes = dict.fromkeys(note for one in found for note in one.notes)
    shared = [note for note in notes if all(note in one.notes for one in found)]
    rows = [_build_parameter_row(one, shared, several=several) for one in found]
    columns = (
        *("parameter", ("logs", "d"), ("fleet's mean", "s"), ("± 95 %", "s"), "unit"),
        *(("spread of units, 1 σ", "s"), (f"drift per {per}" if per else "drift", "s"), "remark"),
    )
    blocks = make_tables("Shared values, at the fields' means.", columns, rows)
    blocks += make_notes("Of all parameters", shared)
    names = ", ".join(map(get_parameter_label, missing))
    blocks += make_notes(
        "Not estimated: too few logs with a value that is not from the card; of several units at "
        "least 6 are needed, of one unit 5, for each field one more",
        [names] if names else [],
    )
    return Section(
        "parameters",
        "Fleet values",
        "Each log counts by what it states of its own error; units may differ, and age. Sensor "
        "errors that a unit keeps are part of the spread: logs alone do not separate them.",
        blocks,
    )


def build_vehicle_section(store: Store, folder: Path) -> Section:
    """Build the values of each vehicle of bus logs; `folder` is the folder of the page."""
    import pyarrow.compute as pc

    rows = store.read_rows(RowKind.PARAMETER)
    rows = rows.filter(pc.equal(rows.column("method"), BUS_METHOD)).to_pylist()
    known = collect_facts(store)
    order = {name: k for k, name in enumerate(dict.fromkeys(row["name"] for row in rows))}
    rows = [row for row in rows if row["log"] in known and row["value"] is not None]
    rows.sort(key=lambda row: (order[row["name"]], known[row["log"]][1].unit))
    cells = []
    for row in rows[:MOST_ROWS]:
        display = get_display_unit(row["si_unit"])
        half = Z95 * row["std_total"] * display.factor
        value, half_text = format_uncertainty(row["value"] * display.factor, half)
        verdict = make_badge(row["verdict"], TONES[Verdict(row["verdict"])])
        unit = known[row["log"]][1].unit
        vehicle = Cell(unit, href=make_report_link(store, row["log"], folder))
        name = make_parameter_cell(row["name"])
        cells.append((name, vehicle, value, half_text, display.label, verdict))
    columns = ("parameter", "vehicle", ("value", "s"), ("± 95 %", "s"), "unit", "verdict")
    caption = f"Each vehicle from all its logs{make_truncation_caption(len(rows))}."
    intro = "Bus logs of one vehicle are identified together and have one result."
    tables = make_tables(caption, columns, cells)
    return Section("vehicles", "Vehicles of bus logs", intro, tables)


def _has_several_rules(found: Sequence[JointEstimate]) -> bool:
    return len({one.rule for one in found}) > 1


def _build_parameter_row(
    one: JointEstimate, shared: Sequence[str], *, several: bool
) -> tuple[object, ...]:
    display = get_display_unit(one.si_unit)
    value, half = format_uncertainty(
        one.value * display.factor, 0.5 * (one.ci95[1] - one.ci95[0]) * display.factor
    )
    spread, between = "", ""
    if one.spread is not None and one.spread_ci95 is not None:
        spread = format_significant(one.spread * display.factor, 2)
        between = _format_interval(one.spread_ci95, display.factor)
    slope, note = "", ""
    if one.drifts:
        factor = display.factor * get_drift_unit(one.drifts[0].field)[0]
        ends = one.drifts[0].ci95
        slope, note = format_uncertainty(
            one.drifts[0].slope * factor, 0.5 * (ends[1] - ends[0]) * factor
        )
        note = f"± {note}"
    name = make_parameter_cell(one.parameter)
    meaning = get_parameter_spec(one.parameter).meaning
    return (
        replace(name, remark=f"{meaning} · {one.rule}" if several else meaning),
        *(one.logs, value, half, display.label),
        make_number(spread, between),
        make_number(slope, note),
        write_remark(one, shared),
    )


def _format_interval(ci95: Interval, factor: float) -> str:
    return f"{format_significant(ci95[0] * factor, 2)} to {format_significant(ci95[1] * factor, 2)}"


def write_remark(one: JointEstimate, shared: Sequence[str] = ()) -> str:
    """Return the remark on an estimate; `shared` is the remark made of all elsewhere."""
    parts = [note for note in one.notes if note not in shared]
    if drift := _compute_range_drift(one):
        parts.append(_format_drift(one, drift) + _describe_small_effect(drift, one))
    if spread := _get_significant_spread(one):
        parts.append("units differ" + _describe_small_effect(spread, one))
    if one.left_out:
        parts.append(f"{one.left_out} logs do not determine it")
    if one.excess > 1.5:
        parts.append(f"logs scatter {one.excess:.1f} times as much as they state")
    return "; ".join(parts)


def _compute_range_drift(one: JointEstimate) -> float:
    """Drift over the whole range of the first field, SI; 0 where its interval holds 0."""
    if not one.drifts or math.prod(one.drifts[0].ci95) <= 0.0:
        return 0.0
    return one.drifts[0].slope * float(np.ptp(one.points.reading))


def _get_significant_spread(one: JointEstimate) -> float:
    """Spread over units, SI; 0 where its interval reaches 0."""
    sure = one.spread is not None and one.spread_ci95 is not None and one.spread_ci95[0] > 0.0
    return one.spread or 0.0 if sure else 0.0


def _format_drift(one: JointEstimate, whole: float) -> str:
    field, readings = one.drifts[0].field, one.points.reading
    ends = format_span(field, float(np.min(readings)), float(np.max(readings)))
    share = 100.0 * whole / one.value
    return f"drifts by {format_significant(share, 2)} % between {ends}"


def _compute_median_error(one: JointEstimate) -> float:
    """Return the median standard error of the logs."""
    return float(np.median(one.points.std))


def _describe_small_effect(size: float, one: JointEstimate) -> str:
    """Describe an effect that is significant but smaller than the error of one log."""
    if abs(size) >= _compute_median_error(one):
        return ""
    return ", by less than one log's own error: an error of the method may look like that"


def build_ageing_section(found: Sequence[JointEstimate]) -> Section:
    """Every parameter over the first field, and by unit where units differ."""
    several = _has_several_rules(found)
    blocks: list[Block] = []
    for one in sorted(found, key=_compute_relative_effect, reverse=True):
        name = get_parameter_label(one.parameter) + (f" of {one.rule}" if several else "")
        if one.drifts:
            text = f"{name}: every log; the shared line with its 95 % band."
            blocks.append(FigureBlock(plot_drift(one), text))
        if _get_significant_spread(one) or any(unit.odd for unit in one.units):
            text = f"{name}: how far each unit is from the shared value, with 95 % intervals."
            blocks.append(FigureBlock(plot_units(one), text))
    intro = (
        "What drifts or differs most, measured by one log's own error, comes first. Units are "
        "shown where they differ beyond the errors of their logs."
    )
    return Section("ageing", "Ageing and units", intro, blocks)


def _compute_relative_effect(one: JointEstimate) -> float:
    """Return the size of the significant drift and spread, relative to the error of one log."""
    return max(
        abs(_compute_range_drift(one)), _get_significant_spread(one)
    ) / _compute_median_error(one)


def _build_outlier_section(store: Store, found: Sequence[JointEstimate], folder: Path) -> Section:
    """Build the units beyond chance, and the logs that do not fit."""
    units = [
        (
            *(unit.unit, make_parameter_cell(one.parameter)),
            *(_format_deviation(one, unit.deviation, unit.std), unit.score),
        )
        for one in found
        for unit in one.units
        if unit.odd
    ]
    columns = (
        *("unit", "parameter", "deviation ± 95 %"),
        ("standard deviations of the units", ".1f"),
    )
    caption = "Units beyond what chance makes. They count in shared value and spread."
    blocks = make_tables(caption, columns, units)
    logs = [
        (
            Cell(Path(outlier.path).name, href=make_report_link(store, outlier.log, folder)),
            *(make_parameter_cell(one.parameter), *_format_values(one, outlier), outlier.reason),
        )
        for one in found
        for outlier in one.outliers
    ]
    caption = f"Logs that do not fit{make_truncation_caption(len(logs))}."
    named = ("log", "parameter", "value", "expected", "reason")
    blocks += make_tables(caption, named, logs[:MOST_ROWS])
    intro = "Logs that do not fit are left out of the shared values above."
    return Section("odd", "Outliers", intro, blocks)


def _format_values(one: JointEstimate, outlier: Outlier) -> tuple[str, str]:
    """Return the value of a log and the value expected from its unit and fields."""
    display = get_display_unit(one.si_unit)
    value = f"{format_significant(outlier.value * display.factor)} {display.label}".removesuffix(
        " –"
    )
    return value, format_significant(outlier.expected * display.factor)


def _format_deviation(one: JointEstimate, value: float, std: float) -> str:
    display = get_display_unit(one.si_unit)
    text, half = format_uncertainty(value * display.factor, Z95 * std * display.factor)
    return f"{text} ± {half} {display.label}".removesuffix(" –")


def _build_friction_section(store: Store) -> Section:
    blocks: list[Block] = [
        FigureBlock(
            plot_friction(element, curve),
            f"Friction of {element}: median of all logs; the band holds 95 % of them.",
        )
        for element, curve in compute_fleet_friction(store).items()
    ]
    return Section("friction", "Friction of the fleet", "μ over slip of every log.", blocks)


def _build_quality_section(store: Store) -> Section:
    """Show each figure of shift quality over the fleet, and the units that differ from the rest."""
    units = collect_unit_figures(store)
    rows = []
    for (kind, gears, name), values in merge_figures(units.values()).items():
        display = get_display_unit(QUALITY_UNITS[name])
        low, median, high = (display.factor * np.quantile(values, (0.1, 0.5, 0.9))).tolist()
        rows.append(
            (get_figure_label(name), f"{gears}, {kind.value}", values.size, median, low, high)
        )
    columns = (
        *("figure", "shift", ("shifts", "d"), ("median", "3")),
        *(("10 %", "3"), ("90 %", "3")),
    )
    blocks = make_tables("Shift quality of the fleet", columns, rows)
    odd = [(unit, one) for unit, one in compare_units(units) if one.differs]
    if odd:
        table = build_comparison_table([one for _, one in odd[:MOST_ROWS]])
        head = (Cell("unit"), *table.head)
        body = [(Cell(unit), *row) for (unit, _), row in zip(odd, table.rows, strict=False)]
        caption = f"Units that differ from all others{make_truncation_caption(len(odd))}."
        blocks.append(TableBlock(caption, head, body))
    text = (
        "Medians are those of the others, then of the unit. Rank-sum tests at 5 %, corrected for "
        "their number."
    )
    return Section("quality", "Shift quality", text, blocks)


def _build_failure_section(store: Store) -> Section:
    sql = (
        "SELECT path, unit, state, error, what, remedy FROM files JOIN logs USING (log) "
        "WHERE error != '' ORDER BY path"
    )
    every = list(store.index.select(sql))
    rows = [
        (
            Cell(Path(path).name, note=unit),
            make_badge(state, Tone.DOUBTFUL),
            error,
            Cell(what, note=remedy),
        )
        for path, unit, state, error, what, remedy in every[:MOST_ROWS]
    ]
    caption = f"Logs without a result{make_truncation_caption(len(every))}."
    blocks = make_tables(caption, ("log", "state", "reason", "what, and what to do"), rows)
    return Section("failed", "Which logs failed, and why", "Nothing is left out silently.", blocks)


def _build_settings_section(store: Store) -> Section:
    """List the settings of the rows, with one note for each settings hash."""
    sql = (
        "SELECT settings, document, count(*) FROM files JOIN logs USING (log) "
        "JOIN settings USING (settings) GROUP BY settings ORDER BY settings"
    )
    blocks: list[Block] = []
    for settings, document, count in store.index.select(sql):
        tree = json.loads(document)
        lines = [
            f"{key}: {value if isinstance(value, str | int | float) else json.dumps(value)}"
            for key, value in sorted(tree.items())
        ]
        blocks.append(NotesBlock(f"Settings {settings[:12]}, {count:,} logs", lines))
    return Section("settings", "Settings and versions", "Other settings make other rows.", blocks)


MOST_ROWS = 200
"""Rows of a table; the store holds them all."""
_MAKE_THEM = " 'drivetwin fleet … --reports' writes a report of each, which is linked here then."


def build_single_logs_section(store: Store, folder: Path) -> Section:
    """Build the table of done logs, poorest fits first; `folder` is the folder of the page."""
    fits = collect_output_fits(store)
    known = collect_facts(store)
    done = [log for log, _ in store.index.iterate_done_logs() if log in known]
    worst = sorted(done, key=lambda log: (fits.get(log, 100.0), known[log][1].path))[:MOST_ROWS]
    fields = list(dict.fromkeys(name for log in worst for name in known[log][1].fields))
    rows = []
    for log in worst:
        fact, href = known[log][1], make_report_link(store, log, folder)
        readings = (
            format_reading(name, fact.fields[name]) if name in fact.fields else None
            for name in fields
        )
        rows.append((Cell(Path(fact.path).name, href=href), fact.unit, *readings, fits.get(log)))
    caption = f"The poorest fit first{make_truncation_caption(len(done))}."
    if not any(store.get_report_path(log).is_file() for log in worst):
        caption += _MAKE_THEM
    columns: Sequence[Column] = (
        *("log", "unit"),
        *((name, "s") for name in fields),
        ("fit of the output torque, %", ".1f"),
    )
    blocks = make_tables(caption, columns, rows)
    intro = "Where to look closer: how well the simulation of each log follows its measurement."
    return Section("logs", "Log by log", intro, blocks)


def make_report_link(store: Store, log: str, folder: Path) -> str:
    """Return the link from a page in `folder` to the report of a log; empty without a report."""
    report = store.get_report_path(log)
    return Path(os.path.relpath(report, folder)).as_posix() if report.is_file() else ""


def make_truncation_caption(count: int) -> str:
    """Return the caption of a truncated table."""
    return f", the first {MOST_ROWS} of {count:,}" if count > MOST_ROWS else ""
