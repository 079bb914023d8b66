# SPDX-License-Identifier: MIT
"""The logs one by one in the report of a fleet, with the way to the report of each."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from drivetwin.fleet.mixed_model.observations import collect_facts
from drivetwin.fleet.mixed_model.reasons import collect_output_fits
from drivetwin.fleet.rules import format_reading
from drivetwin.fleet.store import Store
from drivetwin.report.blocks import Block, Cell, Column, Section, make_table

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
    blocks: list[Block] = [make_table(caption, columns, rows)] if rows else []
    intro = "Where to look closer: how well the simulation of each log follows its measurement."
    return Section("logs", "Log by log", intro, blocks)


def make_report_link(store: Store, log: str, folder: Path) -> str:
    """Return the link from a page in `folder` to the report of a log; empty without a report."""
    report = store.get_report_path(log)
    return Path(os.path.relpath(report, folder)).as_posix() if report.is_file() else ""


def make_truncation_caption(count: int) -> str:
    """Return the caption of a truncated table."""
    return f", the first {MOST_ROWS} of {count:,}" if count > MOST_ROWS else ""
