# SPDX-License-Identifier: MIT
"""`drivetwin fleet`: identification of many logs into a store, and queries of the store."""

from __future__ import annotations

import json
import math
import sys
from collections import Counter
from pathlib import Path
from time import monotonic

from drivetwin._util.progress import notify_progress
from drivetwin._util.text import escape_json
from drivetwin.cli.output import make_console, print_line, show_step
from drivetwin.cli.requests.desk import EstimateFleet, QueryFleet, ReportFleet, RunFleet
from drivetwin.errors import INTERRUPTED, InputError
from drivetwin.fleet.coordinator import FleetRun, run_fleet
from drivetwin.fleet.estimate import estimate_fleet, list_missing_estimates
from drivetwin.fleet.options import FleetOptions
from drivetwin.fleet.query import query_store, save_answer
from drivetwin.fleet.report import PAGE as REPORT
from drivetwin.fleet.report import build_estimate_blocks, save_fleet_report
from drivetwin.fleet.rules import Sources, read_rules
from drivetwin.fleet.store import Store
from drivetwin.fleet.task import (
    Event,
    Limits,
    Noted,
    Retried,
    Settled,
    Started,
    Summary,
    to_document,
)
from drivetwin.report.blocks import Outcome, Tone, VerdictBlock, make_notes, make_table

_LINE_EVERY = 30.0
"""Time [s] between two lines where nobody watches."""


class RunProgress:
    """Running totals of a run: counts, retries and failures by reason."""

    def __init__(self) -> None:
        self._files = self._settled = 0
        self._counts: Counter[str] = Counter()
        drawn = make_console(stderr=True).is_terminal
        self._next = math.inf if drawn else monotonic() + _LINE_EVERY

    def handle(self, event: Event) -> None:
        """Update the totals with an event of the run, and show them."""
        match event:
            case Started(files=files):
                self._files = files
                if event.dashboard:
                    print_line(f"dashboard: {event.dashboard}")
            case Settled():
                self._settled += 1
                self._counts.update([event.error] if event.error else [])
            case Retried():
                self._counts["retries"] += 1
            case Noted():
                print_line(event.text)
        listed = "".join(f", {count} {name}" for name, count in self._counts.most_common())
        text = f"{self._settled} of {self._files} logs{listed}"
        notify_progress(self._settled / max(self._files, 1), text)
        if monotonic() >= self._next and not isinstance(event, Summary):
            print_line(text)
            self._next = monotonic() + _LINE_EVERY


def _print_event(event: Event) -> None:
    sys.stdout.write(escape_json(json.dumps(to_document(event), ensure_ascii=False)) + "\n")
    sys.stdout.flush()


def run(request: RunFleet) -> Outcome:
    """Run the fleet, and show its progress."""
    if not request.logs and request.listed is None:
        raise InputError("no logs are named", "give files, folders, a quoted glob or --list FILE")
    wanted = FleetRun(
        **request.select(FleetOptions),
        sources=Sources(request.logs, request.listed),
        rules=read_rules(request.vehicle),
        store=request.output,
    )
    if request.as_json:
        return _build_outcome(run_fleet(wanted, _print_event), request)
    with show_step("identifying"):
        return _build_outcome(run_fleet(wanted, RunProgress().handle), request)


def _explain(summary: Summary, output: Path) -> VerdictBlock:
    """Build the verdict on a run with the next step."""
    status = f"{summary.done} of {summary.files - summary.skipped} logs identified"
    tone = Tone.DOUBTFUL
    if not summary.complete:
        reason, action = "The run was interrupted.", "The same command goes on from here."
    elif summary.failures:
        name, count = max(summary.failures.items(), key=lambda one: one[1])
        reason = f"The most frequent cause, of {count} logs, is {name}."
        action = "Read the reasons with the query below."
    else:
        reason, tone = "No log failed.", Tone.GOOD
        action = f"Write the report with 'drivetwin fleet report {output}'."
    return VerdictBlock(status, reason, action, tone, "Fleet")


def _build_outcome(summary: Summary, request: RunFleet) -> Outcome:
    """Build the outcome of a run; as JSON its last event has all of it."""
    output, exit_code = request.output, 0 if summary.complete else INTERRUPTED
    if request.as_json:
        return Outcome(is_confirmed=not summary.failures, exit_code=exit_code)
    rows = {
        "identified": summary.done,
        "bad": summary.bad,
        "in quarantine": summary.quarantined,
        "left out by the rules": summary.skipped,
        "computed in this run": summary.computed,
    }
    counts = make_table(f"Fleet in {output}", ("logs", ("count", "d")), rows.items())
    failures = (f"{n} {name}" for name, n in summary.failures.items())
    query = (
        f'reasons: drivetwin fleet query {output} "SELECT path, what FROM files JOIN logs USING '
        "(log) WHERE error <> ''\""
    )
    return Outcome(
        [_explain(summary, output), counts, *make_notes("Failures", failures)],
        is_confirmed=not summary.failures,
        lines=[query] if summary.complete and summary.failures else [],
        exit_code=exit_code,
    )


def report(request: ReportFleet) -> Outcome:
    """Write the page of a store."""
    page = request.store / REPORT if request.output is None else request.output
    with show_step("estimating over the fleet"), Store(request.store) as opened:
        save_fleet_report(opened, page)
    return Outcome(document={"report": page}, files=[page])


def estimate(request: EstimateFleet) -> Outcome:
    """Estimate over the logs of a store."""
    with show_step("estimating over the fleet"), Store(request.store) as opened:
        found = estimate_fleet(opened, request.parameter)
        missing = list_missing_estimates(opened, found, request.parameter)
        blocks = build_estimate_blocks(opened, found, missing, request.store)
    listed = [one.to_document() for one in found]
    return Outcome(blocks, {"estimates": listed, "missing": missing})


def query(request: QueryFleet) -> Outcome:
    """Answer a question in SQL, on the terminal or as a file."""
    output, limits = request.output, Limits(request.time_limit, request.memory_limit)
    with show_step("asking"), Store(request.store) as opened:
        answer = query_store(opened, request.sql, limits)
    if output is not None:
        save_answer(answer, output, request.store)
    rows = [dict(zip(answer.columns, row, strict=True)) for row in answer.rows]
    if output is not None:
        return Outcome((), {"rows": rows}, [output])
    numbers = {
        name
        for name, column in zip(answer.columns, zip(*answer.rows, strict=True), strict=False)
        if all(isinstance(cell, int | float | None) for cell in column)
    }
    columns = [(name, "s") if name in numbers else name for name in answer.columns]
    table = make_table("", columns, (map(_format_cell, row) for row in answer.rows))
    return Outcome([table], {"rows": rows})


def _format_cell(value: object) -> str:
    """A value of an answer as a person reads it; `-o` and `--json` give all digits."""
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
