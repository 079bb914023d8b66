# SPDX-License-Identifier: MIT
"""`drivetwin fleet`: identification of many logs into a store, and queries of the store."""

from __future__ import annotations

import json
import sys
from collections import Counter, deque
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic

from rich.console import Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from drivetwin._util.text import escape_json
from drivetwin.cli.output import make_console, print_line, show_step
from drivetwin.cli.requests.desk import EstimateFleet, QueryFleet, ReportFleet, RunFleet
from drivetwin.errors import INTERRUPTED, InputError
from drivetwin.fleet.coordinator import FleetRun, run_fleet
from drivetwin.fleet.mixed_model.estimate import estimate_fleet, list_missing_estimates
from drivetwin.fleet.options import FleetOptions
from drivetwin.fleet.query import query_store, save_answer
from drivetwin.fleet.report import PAGE as REPORT
from drivetwin.fleet.report import build_estimate_blocks, save_fleet_report
from drivetwin.fleet.rules import Sources, read_rules
from drivetwin.fleet.store import Store
from drivetwin.fleet.task import (
    Event,
    Limits,
    Listener,
    Noted,
    Retried,
    Settled,
    Started,
    State,
    Summary,
    to_document,
)
from drivetwin.report.blocks import Outcome, Tone, VerdictBlock, make_notes, make_table

_REFRESH = 0.25
"""Time [s] between two pictures of the live view."""
_LINE_EVERY = 30.0
"""Time [s] between two lines where nobody watches."""
_RATE_SPAN = 60.0
"""Time [s] over which the rate is counted."""


class Tally:
    """Running totals: counts by state and reason, the present rate, the time left."""

    def __init__(self) -> None:
        self.files = 0
        self.dashboard: str | None = None
        self.states: Counter[State] = Counter()
        self.failures: Counter[str] = Counter()
        self.retries = 0
        self.note = ""
        self._settled: deque[tuple[float, int]] = deque()

    @property
    def settled(self) -> int:
        """Files that have their outcome."""
        return self.states.total()

    def update(self, event: Event) -> None:
        """Update the totals with an event of the run."""
        if isinstance(event, Started):
            self.files, self.dashboard = event.files, event.dashboard
        elif isinstance(event, Settled):
            self.states[event.state] += 1
            if event.error:
                self.failures[event.error] += 1
        elif isinstance(event, Retried):
            self.retries += 1
        elif isinstance(event, Noted):
            self.note = event.text
        self._settled.append((monotonic(), self.settled))
        while self._settled[0][0] < monotonic() - _RATE_SPAN:
            self._settled.popleft()

    def compute_rate(self) -> float:
        """Compute the recent rate [files/s]; 0 without enough events."""
        if len(self._settled) < 2:
            return 0.0
        (start, before), (end, after) = self._settled[0], self._settled[-1]
        return (after - before) / (end - start) if end > start else 0.0

    def format_line(self) -> str:
        """Format the totals as one line."""
        rate = self.compute_rate()
        left = f", {_format_span((self.files - self.settled) / rate)} left" if rate > 0.0 else ""
        failed = "".join(f", {count} {name}" for name, count in self.failures.most_common())
        lost = f", {self.retries} retries" if self.retries else ""
        return f"{self.settled} of {self.files} logs, {rate:.1f}/s{left}{failed}{lost}"


def _format_span(seconds: float) -> str:
    """Format a duration in its largest units."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes}:{rest:02d} min"


@contextmanager
def show_progress(*, as_json: bool) -> Iterator[Listener]:
    """Yield the listener that shows a run; see the module's text."""
    if as_json:
        yield _print_event
        return
    tally, shown = Tally(), make_console(stderr=True)
    if not shown.is_terminal:
        yield _Lines(tally).handle
        return

    with Live(
        get_renderable=lambda: _render_tally(tally), console=shown, transient=True,
        refresh_per_second=1.0 / _REFRESH,
    ):  # fmt: skip
        yield tally.update


def _print_event(event: Event) -> None:
    sys.stdout.write(escape_json(json.dumps(to_document(event), ensure_ascii=False)) + "\n")
    sys.stdout.flush()


class _Lines:
    """A line now and then, for a file that somebody reads later."""

    def __init__(self, tally: Tally) -> None:
        self._tally = tally
        self._next = monotonic() + _LINE_EVERY

    def handle(self, event: Event) -> None:
        """Handle an event of the run; print a line at regular intervals."""
        self._tally.update(event)
        if isinstance(event, Started) and event.dashboard:
            print_line(f"dashboard: {event.dashboard}")
        elif isinstance(event, Noted):
            print_line(event.text)
        elif monotonic() >= self._next and not isinstance(event, Summary):
            print_line(self._tally.format_line())
            self._next = monotonic() + _LINE_EVERY


def _render_tally(tally: Tally) -> RenderableType:
    """Render the live view: bar, rate and time left, failures by reason, messages."""
    head = Table.grid(padding=(0, 2))
    rate = tally.compute_rate()
    left = _format_span((tally.files - tally.settled) / rate) if rate > 0.0 else "–"
    head.add_row(
        ProgressBar(max(tally.files, 1), tally.settled, width=40),
        f"{tally.settled}/{tally.files}", f"{rate:.1f} logs/s", f"{left} left",
    )  # fmt: skip
    parts: list[RenderableType] = [head]
    if tally.failures or tally.retries:
        failed = Table.grid(padding=(0, 2))
        for name, count in tally.failures.most_common():
            failed.add_row(f"  {count}", name)
        if tally.retries:
            failed.add_row(f"  {tally.retries}", "retries after the loss of a worker")
        parts.append(failed)
    if tally.dashboard:
        parts.append(Text(f"dashboard: {tally.dashboard}"))
    if tally.note:
        parts.append(Text(tally.note))
    return Group(*parts)


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
    with show_progress(as_json=request.as_json) as tell:
        return _build_outcome(run_fleet(wanted, tell), request)


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
