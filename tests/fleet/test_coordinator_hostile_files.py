# SPDX-License-Identifier: MIT
"""What a file system holds besides logs: one bad log each, named; the run and its store go on."""

from __future__ import annotations

import itertools
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from drivetwin.errors import INTERRUPTED, StoreError
from tests.fleet.toys import contents, make_logs, names, run_toys


def _run_calmly(logs: Path, store: Path) -> dict[str, Any]:
    """Contents of a store to which nothing happened."""
    run_toys(logs, store)
    return contents(store)


def _spoil(logs: Path) -> list[str]:
    """Put files among the logs that are none; returns their names as events show them."""
    os.mkfifo(logs / "pipe.csv")
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind(str(logs / "socket.csv"))
    (logs / "device.csv").symlink_to("/dev/zero")
    (logs / "loop.csv").symlink_to(logs / "loop.csv")
    (logs / "gone.csv").symlink_to(logs / "nowhere.csv")
    Path(os.fsdecode(os.fsencode(logs) + b"/name\xff.csv")).write_text("n")
    (logs / "inner").symlink_to(logs)
    return ["device", "gone", "loop", "name\\udcff", "pipe", "socket"]


@pytest.mark.parametrize("pattern", ["", "/**/*.csv"])
def test_what_is_no_file_is_one_bad_log_each(tmp_path: Path, pattern: str) -> None:
    logs = make_logs(tmp_path / "logs", 2)
    spoilt = _spoil(logs)
    summary, events = run_toys(logs, tmp_path / "store", given=[f"{logs}{pattern}"])
    assert (summary.done, summary.bad) == (2, len(spoilt))
    assert names(events, state="bad") == spoilt


def test_a_device_of_a_list_is_a_bad_log(tmp_path: Path) -> None:
    logs = make_logs(tmp_path / "logs", 1)
    listed = tmp_path / "list.txt"
    listed.write_text(f"/dev/zero\n/dev/null\n{tmp_path}\n{logs}/unit_0/log_0000.csv\n")
    summary, _ = run_toys(logs, tmp_path / "store", listed=listed)
    assert (summary.done, summary.bad) == (1, 3)


@pytest.mark.parametrize("count", [200, pytest.param(3000, marks=pytest.mark.faults)])
def test_many_tiny_logs_and_one_from_the_past(tmp_path: Path, count: int) -> None:
    logs = make_logs(tmp_path / "logs", count)
    assert run_toys(logs, tmp_path / "store", workers=2)[0].computed == count
    changed = logs / "unit_0" / "log_0000.csv"
    changed.write_text("changed\n")
    os.utime(changed, (1e9, 1e9))  # years before it was scanned
    summary, _ = run_toys(logs, tmp_path / "store")
    assert (summary.done, summary.computed) == (count, 1)


def test_a_clock_set_back_at_every_look(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    logs, now = make_logs(tmp_path / "logs", 5), itertools.count(2_000_000_000, -86_400)
    with monkeypatch.context() as clock:
        clock.setattr(time, "time", lambda: float(next(now)))
        clock.setattr(time, "time_ns", lambda: next(now) * 10**9)
        assert run_toys(logs, tmp_path / "store")[0].computed == 5
        summary, _ = run_toys(logs, tmp_path / "store")
    assert (summary.done, summary.computed) == (5, 0)
    assert contents(tmp_path / "store") == _run_calmly(logs, tmp_path / "calm")


def test_a_store_that_was_copied_goes_on(tmp_path: Path) -> None:
    logs = make_logs(tmp_path / "logs", 5)
    run_toys(logs, tmp_path / "store")
    shutil.copytree(tmp_path / "store", tmp_path / "elsewhere" / "copy")
    shutil.move(logs, tmp_path / "elsewhere" / "logs")
    summary, _ = run_toys(tmp_path / "elsewhere" / "logs", tmp_path / "elsewhere" / "copy")
    assert (summary.done, summary.computed) == (5, 0)


def test_a_truncated_large_part_ends_the_run_and_is_named(tmp_path: Path) -> None:
    logs = make_logs(tmp_path / "logs", 5)
    run_toys(logs, tmp_path / "store")
    (part,) = (tmp_path / "store" / "rows").iterdir()
    for size in (part.stat().st_size - 1, part.stat().st_size // 2, 4, 0):
        os.truncate(part, size)
        with pytest.raises(StoreError, match=part.name):
            run_toys(logs, tmp_path / "store")
    part.unlink()
    assert run_toys(logs, tmp_path / "store")[0].computed == 5


def test_sigterm_while_large_files_are_scanned(tmp_path: Path) -> None:
    logs = make_logs(tmp_path / "logs", 3)
    for number in range(20):
        with (logs / f"large_{number}.csv").open("wb") as file:
            file.truncate(8 * 2**30)
    command = [sys.executable, "-m", "drivetwin", "fleet", str(logs), "--vehicle",
               str(logs / "card.toml"), "-o", str(tmp_path / "store"), "--json"]  # fmt: skip
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        process.send_signal(signal.SIGTERM)
        started = time.monotonic()
        process.communicate(timeout=60.0)
    assert time.monotonic() - started < 2.0
    assert process.returncode == INTERRUPTED
    assert not list((tmp_path / "store").glob("*/*/*.parquet"))
    assert contents(tmp_path / "store")["rows"] == []
