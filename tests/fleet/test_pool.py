# SPDX-License-Identifier: MIT
"""A worker under guard: limits, versions, what it prints, how it ends."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from drivetwin._util.version import get_program_version
from drivetwin.estimation.result.method import Method
from drivetwin.fleet.pool import GuardedWorker
from drivetwin.fleet.task import (
    Aborted,
    Completed,
    Limits,
    ShiftRow,
    State,
    Task,
    TaskSpec,
    WorkerLost,
    WorkerSpec,
)
from tests.fleet.toys import LIMITS


@pytest.fixture
def cell() -> Iterator[GuardedWorker]:
    """A cell whose worker does the toy."""
    made = GuardedWorker(WorkerSpec("tests.fleet.work:toy", LIMITS))
    yield made
    made.close()


def _task(folder: Path, text: str) -> Task:
    path = folder / "log.csv"
    path.write_text(text)
    recipe = TaskSpec("card", None, Method.PAPER, (("vehicle", "00"),), get_program_version())
    return Task("0123", str(path), "content", recipe, str(folder / "part.parquet"))


def test_tasks_survive_the_way_to_the_worker(tmp_path: Path) -> None:
    task = _task(tmp_path, "x")
    assert Task.from_json(task.to_json()) == task


def test_a_worker_does_one_log_after_the_other(cell: GuardedWorker, tmp_path: Path) -> None:
    first = cell.run(_task(tmp_path, "one two"))
    assert isinstance(first, Completed)
    assert first.outcome.state is State.DONE
    assert first.outcome.shifts == (ShiftRow(True, 0.0, 2.0, "2", "3"),)
    second = cell.run(_task(tmp_path, "bad one"))
    assert isinstance(second, Completed)
    assert (second.outcome.state, second.outcome.error) == (State.BAD, "FileFormatError")


def test_what_a_function_prints_is_not_taken_for_an_answer(
    cell: GuardedWorker, tmp_path: Path
) -> None:
    assert isinstance(cell.run(_task(tmp_path, "print")), Completed)


def test_a_worker_behind_dask_keeps_the_memory_that_it_has(
    cell: GuardedWorker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MALLOC_TRIM_THRESHOLD_", "65536")
    reply = cell.run(_task(tmp_path, "one environment"))
    assert isinstance(reply, Completed)
    assert reply.outcome.shifts == (ShiftRow(True, 0.0, 2.0, "2", "3"),)


def test_a_fault_that_nobody_thought_of_is_the_logs(cell: GuardedWorker, tmp_path: Path) -> None:
    reply = cell.run(_task(tmp_path, ""))
    assert isinstance(reply, Completed)
    assert (reply.outcome.state, reply.outcome.error) == (State.BAD, "IndexError")


def test_a_killed_worker_is_lost_and_the_next_one_works(
    cell: GuardedWorker, tmp_path: Path
) -> None:
    reply = cell.run(_task(tmp_path, "die"))
    assert isinstance(reply, WorkerLost)
    assert "SIGKILL" in reply.reason
    assert isinstance(cell.run(_task(tmp_path, "one")), Completed)


def test_a_part_that_cannot_be_written_stops_all(cell: GuardedWorker, tmp_path: Path) -> None:
    task = replace(_task(tmp_path, "one"), part=str(tmp_path / "log.csv" / "part.parquet"))
    reply = cell.run(task)
    assert isinstance(reply, Aborted)
    assert "cannot write" in reply.what


def test_a_log_whose_drive_fails_stops_nobody_and_is_no_bad_log(
    cell: GuardedWorker, tmp_path: Path
) -> None:
    task = _task(tmp_path, "one unread")
    reply = cell.run(task)
    assert isinstance(reply, Completed)
    assert (reply.outcome.state, reply.outcome.error) == (State.QUARANTINED, "OSError")
    assert "Input/output error" in reply.outcome.what
    assert "--retry" in reply.outcome.remedy
    assert not Path(task.part).exists()


def test_another_version_is_not_mixed_in(cell: GuardedWorker, tmp_path: Path) -> None:
    task = _task(tmp_path, "one")
    other = replace(task, recipe=replace(task.recipe, version="0.0.0+other"))
    reply = cell.run(other)
    assert isinstance(reply, Aborted)
    assert "0.0.0+other" in reply.what
    assert not Path(task.part).exists()


def test_a_worker_that_is_told_a_wrong_function_says_so(tmp_path: Path) -> None:
    reply = GuardedWorker(WorkerSpec("tests.fleet.work:nothing", Limits())).run(
        _task(tmp_path, "one")
    )
    assert isinstance(reply, Aborted)
    assert "nothing" in reply.what


@pytest.mark.parametrize("place", ["before", "after"])
def test_a_worker_that_starts_while_the_run_ends_is_ended_too(
    cell: GuardedWorker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    """The end of a run may come between the decision to start a worker and its process."""
    spawn = GuardedWorker._spawn

    def spawn_at_the_end(self: GuardedWorker) -> None:
        if place == "before":
            self.kill()
        spawn(self)
        if place == "after":
            self.kill()

    monkeypatch.setattr(GuardedWorker, "_spawn", spawn_at_the_end)
    began = time.monotonic()
    reply = cell.run(_task(tmp_path, "hang"))
    assert isinstance(reply, WorkerLost)
    assert not reply.blame
    assert time.monotonic() - began < 10.0
