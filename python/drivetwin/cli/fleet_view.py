# SPDX-License-Identifier: MIT
"""Progress of a fleet run: a live view in a terminal, lines in a file, JSON for machines."""

from __future__ import annotations

import json
import sys
from collections import Counter, deque
from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic
from typing import TYPE_CHECKING

from drivetwin._util.visible_text import escape_json
from drivetwin.cli.output import make_console, print_line
from drivetwin.fleet.events import (
    Event,
    Listener,
    Noted,
    Retried,
    Settled,
    Started,
    Summary,
    to_document,
)
from drivetwin.fleet.task import State

if TYPE_CHECKING:
    from rich.console import RenderableType

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
    from rich.live import Live

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
    from rich.console import Group
    from rich.progress_bar import ProgressBar
    from rich.table import Table
    from rich.text import Text

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
