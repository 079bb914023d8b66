# SPDX-License-Identifier: MIT
"""What a run shows: counts, rate, time left, failures by reason; events as JSON."""

from __future__ import annotations

import json
from io import StringIO

import pytest
from rich.console import Console

from drivetwin.cli import fleet_view
from drivetwin.cli.fleet_view import Tally, show_progress
from drivetwin.fleet.events import Noted, Retried, Settled, Started, Summary
from drivetwin.fleet.task import State

BAD = Settled("/l/a.csv", "k", "u", State.BAD, True, 0.1, "UnitError", "no unit")
DONE = Settled("/l/b.csv", "k", "u", State.DONE, True, 0.1)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """A clock that a test sets."""
    now = [100.0]
    monkeypatch.setattr(fleet_view, "monotonic", lambda: now[0])
    return now


def test_rate_and_time_left_are_those_of_late(clock: list[float]) -> None:
    tally = Tally()
    tally.update(Started(7300, "s", None))
    for _ in range(100):
        clock[0] += 0.5
        tally.update(DONE)
    assert tally.compute_rate() == pytest.approx(2.0)
    assert tally.format_line() == "100 of 7300 logs, 2.0/s, 1 h 00 min left"
    clock[0] += 1000.0
    tally.update(DONE)
    assert tally.compute_rate() == 0.0


def test_a_terminal_shows_failures_by_reason_and_the_dashboard(clock: list[float]) -> None:
    tally = Tally()
    events = (
        Started(4, "s", "http://host:8787"), BAD, DONE, Retried("k", "was lost", 0.5), Noted("hm"),
    )  # fmt: skip
    for event in events:
        clock[0] += 1.0
        tally.update(event)
    shown = Console(file=StringIO(), width=100)
    shown.print(fleet_view._render_tally(tally))
    text = shown.file.getvalue()  # type: ignore[attr-defined]
    for words in ("2/4", "1  UnitError", "1  retries", "http://host:8787", "hm", "left"):
        assert words in text


def test_a_file_gets_a_line_now_and_then(
    clock: list[float], capsys: pytest.CaptureFixture[str]
) -> None:
    with show_progress(as_json=False) as tell:
        tell(Started(4, "s", "http://host:8787"))
        tell(BAD)
        clock[0] += 31.0
        tell(DONE)
        tell(DONE)
        tell(Noted("the scheduler is back"))
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "dashboard: http://host:8787"
    assert lines[1].startswith("2 of 4 logs")
    assert "1 UnitError" in lines[1]
    assert lines[2] == "the scheduler is back"


def test_machines_get_an_event_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    end = Summary(1, 0, 1, 0, 0, 1, 0.5, True, {"UnitError": 1})
    with show_progress(as_json=True) as tell:
        tell(BAD)
        tell(end)
    first, last = map(json.loads, capsys.readouterr().out.splitlines())
    assert (first["event"], first["state"], first["error"]) == ("log", "bad", "UnitError")
    assert (last["event"], last["failures"]) == ("summary", {"UnitError": 1})
