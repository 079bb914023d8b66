# SPDX-License-Identifier: MIT
"""The logs one by one in the report of a fleet, with the way to the report of each."""

from __future__ import annotations

import os
from pathlib import Path

from drivetwin.fleet.mixed_model.observations import LogFacts, collect_facts
from drivetwin.fleet.mixed_model.reasons import collect_output_fits
from drivetwin.fleet.rules import format_reading
from drivetwin.fleet.store import Store
from drivetwin.report.sections.blocks import Block, Cell, Section, TableBlock, make_cells

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
    rows = [
        _build_row(known[log][1], fields, fits.get(log), make_report_link(store, log, folder))
        for log in worst
    ]
    head = (
        *make_cells("log", "unit"),
        *make_cells(*fields, "fit of the output torque, %", number=True),
    )
    caption = f"The poorest fit first{make_truncation_caption(len(done))}."
    if not any(row[0].href for row in rows):
        caption += _MAKE_THEM
    blocks: list[Block] = [TableBlock(caption, head, rows)] if rows else []
    intro = "Where to look closer: how well the simulation of each log follows its measurement."
    return Section("logs", "Log by log", intro, blocks)


def _build_row(fact: LogFacts, fields: list[str], fit: float | None, href: str) -> tuple[Cell, ...]:
    readings = (
        format_reading(name, fact.fields[name]) if name in fact.fields else "–" for name in fields
    )
    return (
        Cell(Path(fact.path).name, href=href),
        *make_cells(fact.unit),
        *make_cells(*readings, "–" if fit is None else f"{fit:.1f}", number=True),
    )


def make_report_link(store: Store, log: str, folder: Path) -> str:
    """Return the link from a page in `folder` to the report of a log; empty without a report."""
    report = store.get_report_path(log)
    return Path(os.path.relpath(report, folder)).as_posix() if report.is_file() else ""


def make_truncation_caption(count: int) -> str:
    """Return the caption of a truncated table."""
    return f", the first {MOST_ROWS} of {count:,}" if count > MOST_ROWS else ""
