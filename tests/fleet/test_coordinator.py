# SPDX-License-Identifier: MIT
"""Runs as a whole: every log is settled once, what is done stays done, settings make new rows."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.errors import StoreError
from tests.fleet.toys import contents, count_attempts, make_logs, names, run_toys


def test_every_log_is_settled_once_and_never_computed_again(tmp_path: Path) -> None:
    logs, store = make_logs(tmp_path / "logs", 9, spoilt=["bad"]), tmp_path / "store"
    summary, events = run_toys(logs, store, workers=2)
    assert (summary.files, summary.done, summary.bad, summary.computed) == (9, 8, 1, 9)
    assert events[-1] is summary
    assert names(events) == [f"log_{n:04d}" for n in range(9)]
    assert names(events, state="bad") == ["log_0000"]
    before = contents(store)
    assert len(before["rows"]) == 8
    again, _ = run_toys(logs, store)
    assert (again.done, again.bad, again.computed) == (8, 1, 0)
    assert contents(store) == before


def test_new_logs_join_the_old_ones(tmp_path: Path) -> None:
    logs, store = make_logs(tmp_path / "logs", 5), tmp_path / "store"
    run_toys(logs, store)
    (logs / "unit_1" / "late.csv").write_text("late one\n")
    summary, events = run_toys(logs, store)
    assert summary.computed == 1
    assert names(events, computed=True) == ["late"]
    other = tmp_path / "other"
    run_toys(logs, other)
    assert contents(store) == contents(other)


def test_a_changed_setting_is_a_new_row_and_the_old_one_stays(tmp_path: Path) -> None:
    logs, store = make_logs(tmp_path / "logs", 3), tmp_path / "store"
    run_toys(logs, store)
    summary, _ = run_toys(logs, store, quick=True)
    assert summary.computed == 3
    found = contents(store)
    assert len(found["logs"]) == 6
    assert len({row["settings"] for row in found["logs"]}) == 2
    (logs / "card.toml").write_text("gears = 2\nelements = 1\n")
    assert run_toys(logs, store)[0].computed == 3
    current = {row["log"] for row in found["files"]}
    assert len(contents(store)["logs"]) == 9
    assert current.isdisjoint(row["log"] for row in contents(store)["files"])


def test_equal_content_is_one_log_and_every_file_is_named(tmp_path: Path) -> None:
    logs, store = make_logs(tmp_path / "logs", 3), tmp_path / "store"
    (logs / "unit_2" / "copy.csv").write_text((logs / "unit_0" / "log_0000.csv").read_text())
    summary, events = run_toys(logs, store)
    assert (summary.done, summary.computed) == (4, 3)
    assert "copy" in names(events, state="done")
    found = contents(store)
    assert len(found["logs"]) == 3
    assert len(found["files"]) == 4


def test_what_hangs_eats_or_kills_is_quarantined_with_its_reason(tmp_path: Path) -> None:
    spoilt = ["hang", "eat", "die"]
    logs, store = make_logs(tmp_path / "logs", 8, spoilt=spoilt), tmp_path / "store"
    summary, events = run_toys(logs, store, time_limit=5.0, attempts=2, workers=2)
    assert (summary.done, summary.quarantined) == (5, 3)
    assert summary.failures == {"TimeLimit": 1, "MemoryLimit": 1, "WorkerLost": 1}
    for number, error in enumerate(("TimeLimit", "MemoryLimit", "WorkerLost")):
        assert names(events, error=error) == [f"log_{number:04d}"]
    texts = {row["error"]: row["what"] for row in contents(store)["logs"]}
    assert "5 s" in texts["TimeLimit"]
    assert "200 MiB" in texts["MemoryLimit"]
    assert "lost 2 times" in texts["WorkerLost"]
    assert "SIGKILL" in texts["WorkerLost"]
    tries = count_attempts(store)
    assert (tries["WorkerLost"], tries["TimeLimit"]) == (2, 1)


def test_quarantine_is_left_when_asked_for(tmp_path: Path) -> None:
    logs, store = make_logs(tmp_path / "logs", 2, spoilt=["die"]), tmp_path / "store"
    assert run_toys(logs, store, attempts=1)[0].quarantined == 1
    assert run_toys(logs, store, attempts=1)[0].computed == 0
    again, _ = run_toys(logs, store, attempts=1, retry=True)
    assert (again.computed, again.quarantined) == (1, 1)


def test_workers_that_cannot_start_stop_the_run_and_blame_no_log(tmp_path: Path) -> None:
    logs, store = make_logs(tmp_path / "logs", 3), tmp_path / "store"
    with pytest.raises(StoreError, match=r"no worker starts.*not_there"):
        run_toys(logs, store, function="tests.fleet.work:not_there")
    assert {row["state"] for row in contents(store)["logs"]} == {"waiting"}
    assert run_toys(logs, store)[0].done == 3


def test_files_that_cannot_be_taken_are_named_and_looked_at_again(tmp_path: Path) -> None:
    logs, store = make_logs(tmp_path / "logs", 3), tmp_path / "store"
    gone = logs / "unit_0" / "gone.csv"
    gone.symlink_to(logs / "nowhere")
    summary, events = run_toys(logs, store)
    assert names(events, state="bad", error="FileFormatError") == ["gone"]
    gone.unlink()
    gone.write_text("now it is there\n")
    summary, events = run_toys(logs, store)
    assert (summary.done, summary.bad) == (4, 0)
    assert names(events, computed=True) == ["gone"]
