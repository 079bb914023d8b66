# SPDX-License-Identifier: MIT
"""The report of a fleet: one page, drawn with what the report of a log is drawn with."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from drivetwin.fleet.figures import drift_figure, unit_label, units_figure
from drivetwin.fleet.friction import fleet_friction
from drivetwin.fleet.joint.estimate import joint_estimates
from drivetwin.fleet.joint.result import Interval, JointEstimate
from drivetwin.fleet.pages import LIBRARY
from drivetwin.fleet.store import REPORTS, Store
from drivetwin.fleet.task import State
from drivetwin.report.figures.friction import friction_figure
from drivetwin.report.html import render_page
from drivetwin.report.labels import parameter_label
from drivetwin.report.sections.blocks import (
    Block,
    Cell,
    FigureBlock,
    NotesBlock,
    Section,
    TableBlock,
    Tile,
    TilesBlock,
    Tone,
    cells,
)
from drivetwin.report.units import display_of, significant, with_uncertainty
from drivetwin.results.atomic import write_text

PAGE = "report.html"
_MOST_ROWS = 200
"""Rows of a table; the store holds them all."""


def save_fleet_report(store: Store, path: Path) -> list[JointEstimate]:
    """Estimate jointly and write the page; it appears whole or not at all.

    Within the store it uses the library that the single reports share, where there is one.
    """
    found = joint_estimates(store)
    shared = store.folder / REPORTS / LIBRARY
    inside = path.absolute().parent == store.folder and shared.is_file()
    write_text(path, render_fleet(store, found, f"{REPORTS}/{LIBRARY}" if inside else None))
    return found


def render_fleet(store: Store, found: Sequence[JointEstimate], library: str | None = None) -> str:
    """HTML text of the page."""
    sections = [
        _overview(store),
        _parameters(found),
        _odd(store, found),
        _ageing(found),
        _friction(store),
        _failed(store),
        _settings(store),
    ]
    files = _count(store, "SELECT count(*) FROM files")
    units = _count(store, "SELECT count(DISTINCT unit) FROM files")
    return render_page(
        f"Fleet of {units} units",
        f"{files:,} logs in {store.folder.name}",
        [section for section in sections if section.blocks],
        library,
    )


def _count(store: Store, sql: str, *values: object) -> int:
    (row,) = store.index.select(sql, *values)
    return int(row[0])


_STATES = "SELECT count(*) FROM files JOIN logs USING (log) WHERE state = ?"


def _overview(store: Store) -> Section:
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
    rows = [
        (Cell(error), Cell(str(n), number=True), Cell(what))
        for error, n, what in store.index.select(sql)
    ]
    blocks: list[Block] = [TilesBlock(tiles)]
    if rows:
        head = (*cells("reason"), Cell("logs", number=True), *cells("for example"))
        blocks.append(TableBlock("Why logs failed.", head, rows))
    return Section("fleet", "The fleet", "What was there, and what became of it.", blocks)


_SHIFTS = "SELECT count(*) FROM shifts WHERE state = 'used' AND log IN (SELECT log FROM files)"


def _parameters(found: Sequence[JointEstimate]) -> Section:
    rows = [_parameter_row(one) for one in found]
    head = (
        Cell("parameter"), Cell("logs", number=True), Cell("fleet's mean", number=True),
        Cell("± 95 %", number=True), Cell("unit"), Cell("spread over units (1 σ)", number=True),
        Cell("drift", number=True), Cell("remark"),
    )  # fmt: skip
    blocks: list[Block] = [TableBlock("Shared values, at the fields' means.", head, rows)]
    return Section(
        "parameters",
        "What the logs say together",
        "Each log counts by what it states of its own error; units may differ, and age. Sensor "
        "errors that a unit keeps are part of the spread: logs alone cannot tell them apart.",
        blocks if rows else [],
    )


def _parameter_row(one: JointEstimate) -> tuple[Cell, ...]:
    display = display_of(one.si_unit)
    value, half = with_uncertainty(
        one.value * display.factor, 0.5 * (one.ci95[1] - one.ci95[0]) * display.factor
    )
    spread, between = "", ""
    if one.spread is not None and one.spread_ci95 is not None:
        spread = significant(one.spread * display.factor, 2)
        between = _between(one.spread_ci95, display.factor)
    drift = one.drifts[0] if one.drifts else None
    slope = "" if drift is None else significant(drift.slope * display.factor, 2)
    note = "" if drift is None else _between(drift.ci95, display.factor) + f" per {drift.field}"
    return (
        Cell(parameter_label(one.parameter), note=one.rule),
        Cell(str(one.logs), number=True),
        Cell(value, number=True),
        Cell(half, number=True),
        Cell(display.label),
        Cell(spread, number=True, note=between),
        Cell(slope, number=True, note=note),
        Cell(_remark(one)),
    )


def _between(ci95: Interval, factor: float) -> str:
    return f"{significant(ci95[0] * factor, 2)} to {significant(ci95[1] * factor, 2)}"


def _remark(one: JointEstimate) -> str:
    parts = list(one.notes)
    own = float(np.median(one.points.std))
    if one.drifts and math.prod(one.drifts[0].ci95) > 0.0:
        whole = abs(one.drifts[0].slope) * float(np.ptp(one.points.reading))
        parts.append("drifts" + _small(whole, own))
    if one.spread is not None and one.spread_ci95 is not None and one.spread_ci95[0] > 0.0:
        parts.append("units differ" + _small(one.spread, own))
    if one.left_out:
        parts.append(f"{one.left_out} logs tell nothing of it")
    if one.excess > 1.5:
        parts.append(f"logs scatter {one.excess:.1f} times as much as they state")
    return "; ".join(parts)


def _small(size: float, own: float) -> str:
    """What to say of an effect that is real but less than one log's own error `own`."""
    if size >= own:
        return ""
    return ", by less than one log's own error: an error of the method may look like that"


def _ageing(found: Sequence[JointEstimate]) -> Section:
    """Every parameter over the first field, and by unit; those that drift or differ first."""
    several = len({one.rule for one in found}) > 1
    blocks: list[Block] = []
    for one in sorted(found, key=lambda one: not _tells(one)):
        name = parameter_label(one.parameter) + (f" of {one.rule}" if several else "")
        if one.drifts:
            text = f"{name}: every log; the shared line with its 95 % band."
            if one.changes:
                text += " Dashed: a unit changed there."
            blocks.append(FigureBlock(drift_figure(one), text))
        if len(one.units) > 1:
            text = f"{name}: how far each unit is from the shared value, with 95 % intervals."
            blocks.append(FigureBlock(units_figure(one), text))
    return Section(
        "ageing", "Ageing and units", "Parameters that drift or differ over units first.", blocks
    )


def _tells(one: JointEstimate) -> bool:
    """Whether a parameter drifts, or differs over units, beyond its intervals."""
    drifts = bool(one.drifts) and math.prod(one.drifts[0].ci95) > 0.0
    return drifts or (one.spread_ci95 is not None and one.spread_ci95[0] > 0.0)


def _odd(store: Store, found: Sequence[JointEstimate]) -> Section:
    """Changes of units, units beyond chance, logs that do not fit."""
    blocks: list[Block] = []
    changes = [
        cells(
            change.unit, parameter_label(one.parameter),
            f"between {change.before:g} and {change.after:g} of {change.field}",
            _with_error(one, change.size, change.std),
        )
        for one in found for change in one.changes
    ]  # fmt: skip
    if changes:
        head = cells("unit", "parameter", "where", "step ± 95 %")
        blocks.append(TableBlock("Units that changed, as after a repair.", head, changes))
    units = [
        cells(
            unit_label(unit.unit, unit.since), parameter_label(one.parameter),
            _with_error(one, unit.deviation, unit.std), f"{unit.score:.1f}",
        )
        for one in found for unit in one.units if unit.odd
    ]  # fmt: skip
    if units:
        head = cells("unit", "parameter", "deviation ± 95 %", "standard deviations of the units")
        blocks.append(TableBlock("Units beyond what chance makes.", head, units))
    logs = [
        (
            Cell(Path(outlier.path).name, href=_single(store, outlier.log)),
            *cells(parameter_label(one.parameter), outlier.reason),
        )
        for one in found
        for outlier in one.outliers
    ]
    if logs:
        caption = f"Logs that do not fit{_cut(len(logs))}."
        blocks.append(TableBlock(caption, cells("log", "parameter", "reason"), logs[:_MOST_ROWS]))
    return Section("odd", "What is odd", "Left out of the shared values above.", blocks)


def _with_error(one: JointEstimate, value: float, std: float) -> str:
    display = display_of(one.si_unit)
    text, half = with_uncertainty(value * display.factor, 1.96 * std * display.factor)
    return f"{text} ± {half} {display.label}".removesuffix(" –")


def _single(store: Store, log: str) -> str:
    """Link to the report of a single log; empty where there is none."""
    return f"{REPORTS}/{log}.html" if store.report(log).is_file() else ""


def _cut(count: int) -> str:
    return f", the first {_MOST_ROWS} of {count}" if count > _MOST_ROWS else ""


def _friction(store: Store) -> Section:
    blocks: list[Block] = [
        FigureBlock(
            friction_figure(element, curve),
            f"Friction of {element}: median of all logs; the band holds 95 % of them.",
        )
        for element, curve in fleet_friction(store).items()
    ]
    return Section("friction", "Friction of the fleet", "μ over slip of every log.", blocks)


def _failed(store: Store) -> Section:
    sql = (
        "SELECT path, unit, state, error, what, remedy FROM files JOIN logs USING (log) "
        "WHERE error != '' ORDER BY path"
    )
    every = list(store.index.select(sql))
    rows = [
        (
            Cell(Path(path).name, note=unit),
            Cell(state, badge=True, tone=Tone.DOUBTFUL),
            Cell(error),
            Cell(what, note=remedy),
        )
        for path, unit, state, error, what, remedy in every[:_MOST_ROWS]
    ]
    blocks: list[Block] = []
    if rows:
        caption = f"Logs without a result{_cut(len(every))}."
        blocks.append(
            TableBlock(caption, cells("log", "state", "reason", "what, and what to do"), rows)
        )
    return Section("failed", "Which logs failed, and why", "Nothing is left out silently.", blocks)


def _settings(store: Store) -> Section:
    """What the rows were made with; one note for each settings hash in use."""
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
