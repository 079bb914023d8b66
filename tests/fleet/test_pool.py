# SPDX-License-Identifier: MIT
"""A worker under guard: versions, what it prints, faults of a log, and its end."""

from __future__ import annotations

import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from drivetwin.errors import StoreError
from drivetwin.fleet.pool import GuardedWorker
from drivetwin.fleet.task import WorkerSpec
from tests.fleet.toys import contents, make_logs, names, run_toys


def test_what_a_log_does_to_its_worker_stops_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Print, fail to be read, be empty; one worker does them all, with the memory that it has."""
    monkeypatch.setenv("MALLOC_TRIM_THRESHOLD_", "65536")
    logs = make_logs(tmp_path / "logs", 4, spoilt=["print", "unread", "environment"])
    (logs / "unit_0" / "log_0003.csv").write_text("")
    summary, events = run_toys(logs, tmp_path / "store")
    assert (summary.done, summary.bad, summary.quarantined) == (2, 1, 1)
    assert names(events, error="IndexError") == ["log_0003"]
    assert names(events, error="OSError") == ["log_0001"]
    found = contents(tmp_path / "store")
    assert {one["end"] for one in found["shifts"]} == {2.0}  # no setting of memory is a third word
    (fault,) = [one for one in found["logs"] if one["error"] == "OSError"]
    assert fault["state"] == "quarantined"
    assert "Input/output error" in fault["what"]
    assert "--retry" in fault["remedy"]


def test_another_version_is_not_mixed_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    logs = make_logs(tmp_path / "logs", 1)
    monkeypatch.setattr("drivetwin.fleet.scan.get_program_version", lambda: "0.0.0+other")
    with pytest.raises(StoreError, match=r"0\.0\.0\+other"):
        run_toys(logs, tmp_path / "store")
    assert contents(tmp_path / "store")["rows"] == []


@pytest.mark.parametrize("place", ["before", "after"])
def test_a_worker_that_starts_while_the_run_ends_is_ended_too(
    monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    """The end of a run may come between the decision to start a worker and its process."""
    cell = GuardedWorker(WorkerSpec("tests.fleet.work:toy"))
    spawn = GuardedWorker._spawn

    def spawn_at_the_end(self: GuardedWorker) -> None:
        if place == "before":
            self.kill()
        spawn(self)
        if place == "after":
            self.kill()

    monkeypatch.setattr(GuardedWorker, "_spawn", spawn_at_the_end)
    began = time.monotonic()
    task: Any = SimpleNamespace(to_json=lambda: pytest.fail("the worker got a task"))
    reply: Any = cell.run(task)
    cell.close()
    assert reply.blame is False
    assert time.monotonic() - began < 10.0
