# SPDX-License-Identifier: MIT
"""Bus logs of one vehicle in a fleet: identified together, with one result in the store."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import DrivetwinError, FileFormatError, Where
from drivetwin.fleet.pages import save_vehicle
from drivetwin.fleet.parts import convert_write_errors
from drivetwin.fleet.rows import Found, Row, RowKind, make_estimate_row
from drivetwin.fleet.sources import name_members
from drivetwin.fleet.task import ShiftRow, Task
from drivetwin.logs.open_mapped import NOTHING_STATED
from drivetwin.logs.read import read_log
from drivetwin.report.bus_outcome import BusOutcome, identify_vehicle
from drivetwin.vehicle.ratio_card import load_ratio_card


def identify_members(task: Task, mapping: Path | None) -> Found:
    """Identify a vehicle from its bus logs, and write its report where one is wanted.

    A log that cannot be read is left out with a warning. Raises the error of the last one if none
    can be read, FileFormatError for a log that changed, StoreError where the report cannot be
    written, OSError where the drive fails that a log is on.
    """
    names = name_members([path for path, _ in task.members])
    logs: list[ShiftLog] = []
    rows: list[Row] = []
    for (path, content), name in zip(task.members, names, strict=True):
        try:
            log = read_log(Path(path), None, mapping or NOTHING_STATED)
        except DrivetwinError as error:
            if len(rows) + 1 == len(task.members):
                raise
            text = f"{name} is left out: {error.what}"
            rows.append(Row(RowKind.WARNING, "", reason=text))
            continue
        if log.sha256 != content:
            raise FileFormatError(
                "the file changed while the fleet was at work",
                "run the same command again when it is complete",
                Where(file=path),
            )
        logs.append(replace(log, source=name))
    outcome = identify_vehicle(logs, load_ratio_card(Path(task.recipe.vehicle)))
    if task.report is not None:
        with convert_write_errors():
            save_vehicle(Path(task.report), outcome)
    return Found([*_make_rows(outcome), *rows], list(_make_shift_rows(outcome)))


def _make_rows(outcome: BusOutcome) -> Iterator[Row]:
    """Yield the rows of all estimates and findings."""
    yield from map(make_estimate_row, outcome.found.estimates.values())
    for one in (*outcome.remarks, *outcome.found.findings):
        yield Row(RowKind.WARNING, one.code.value, reason=one.text)


def _make_shift_rows(outcome: BusOutcome) -> Iterator[ShiftRow]:
    for shift in outcome.found.shifts:
        span = shift.phases[0][1][0], shift.phases[-1][1][1]
        yield ShiftRow(True, *span, start_gear=shift.start_gear, end_gear=shift.end_gear)
