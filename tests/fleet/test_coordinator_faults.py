# SPDX-License-Identifier: MIT
"""Faults: after the same command is given again the store is that of a run without any.

`FLEET_FAULT_LOGS` sets how many logs each fault meets; `make test-faults` does.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from drivetwin.errors import StoreError
from tests.fleet.toys import ROOT, contents, count_attempts, make_logs, run_toys
from tests.support.repeats import mark_repeats

COUNT = int(os.environ.get("FLEET_FAULT_LOGS", "30"))


def children(pid: int) -> list[int]:
    """Processes whose parent is `pid`."""
    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == pid:
            found.append(int(status.parent.name))
    return found


def undisturbed(logs: Path, store: Path) -> dict[str, Any]:
    """What the store holds when nothing happens."""
    run_toys(logs, store)
    return contents(store)


def start_coordinator(logs: Path, store: Path) -> subprocess.Popen[bytes]:
    """Start a run in another process."""
    command = [sys.executable, "-m", "tests.fleet.toys", str(logs), str(store)]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE)


@pytest.mark.short
@pytest.mark.faults
def test_workers_killed_at_random_cost_nothing(tmp_path: Path) -> None:
    logs = make_logs(tmp_path / "logs", COUNT, word="slow", spoilt=["bad"])
    dice, killed = random.Random(1), []

    def kill_now_and_then(event: Any) -> None:
        workers = children(os.getpid())
        if hasattr(event, "computed") and workers and dice.random() < 0.2:
            killed.append(dice.choice(workers))
            os.kill(killed[-1], signal.SIGKILL)

    summary, _ = run_toys(logs, tmp_path / "store", kill_now_and_then, attempts=50, workers=2)
    assert len(killed) >= 3
    assert (summary.done, summary.bad) == (COUNT - 1, 1)
    assert contents(tmp_path / "store") == undisturbed(logs, tmp_path / "calm")


@pytest.mark.faults
def test_a_coordinator_killed_three_times_goes_on_where_it_was(tmp_path: Path) -> None:
    logs = make_logs(tmp_path / "logs", COUNT, word="slow", spoilt=["bad"])
    store, computed = tmp_path / "store", []
    for share in (0.2, 0.5, 0.8, None):
        with start_coordinator(logs, store) as coordinator:
            assert coordinator.stdout is not None
            settled = 0
            for line in coordinator.stdout:
                event = json.loads(line)
                if event["event"] == "log":
                    settled += 1
                    computed += [event["log"]] if event["computed"] else []
                if share is not None and settled >= share * COUNT:
                    coordinator.kill()
                    break
    assert contents(store) == undisturbed(logs, tmp_path / "calm")
    assert len(computed) == len(set(computed)), "a log was computed twice"
    assert max(count_attempts(store).values()) <= 1


@contextmanager
def small_disk(folder: Path, size: int) -> Iterator[None]:
    """A tmpfs of `size` bytes at `folder`; skips where mounting is not allowed."""
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    try:
        done = subprocess.run(command, capture_output=True, check=False)
    except FileNotFoundError:
        pytest.skip("there is no mount command")
    if done.returncode:
        pytest.skip(f"a small tmpfs cannot be mounted here: {done.stderr.decode().strip()}")
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


def test_a_full_disk_is_told_and_the_run_goes_on_when_there_is_room(tmp_path: Path) -> None:
    logs = make_logs(tmp_path / "logs", COUNT)
    disk, size = tmp_path / "disk", 1_000_000 + 30_000 * COUNT
    with small_disk(disk, size):
        store, ballast = disk / "store", disk / "ballast"
        ballast.write_bytes(bytes(size - 150_000))
        with pytest.raises(StoreError, match=r"No space|full") as reported:
            run_toys(logs, store)
        assert "make room" in reported.value.remedy or "free space" in reported.value.remedy
        found = contents(store)
        assert len(found["rows"]) < COUNT
        ballast.unlink()
        run_toys(logs, store)
        assert contents(store) == undisturbed(logs, tmp_path / "calm")


def test_a_read_only_store_is_told_and_can_still_be_read(tmp_path: Path) -> None:
    logs = make_logs(tmp_path / "logs", 3)
    disk = tmp_path / "disk"
    with small_disk(disk, 5_000_000):
        store = disk / "store"
        run_toys(logs, store)
        before = contents(store)
        (logs / "unit_0" / "new.csv").write_text("one more\n")
        subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
        with pytest.raises(StoreError, match="cannot be written"):
            run_toys(logs, store)
        assert contents(store) == before


def test_two_coordinators_do_not_share_a_store(tmp_path: Path) -> None:
    logs, store = make_logs(tmp_path / "logs", 30, word="slow"), tmp_path / "store"
    with start_coordinator(logs, store) as first:
        assert first.stdout is not None
        first.stdout.readline()
        with pytest.raises(StoreError, match="another"):
            run_toys(logs, store)
        first.communicate(timeout=60.0)
    assert first.returncode == 0
    assert run_toys(logs, store)[0].computed == 0
    assert contents(store) == undisturbed(logs, tmp_path / "calm")


@pytest.mark.parametrize(
    "number", mark_repeats([signal.SIGTERM, signal.SIGINT], [signal.SIGTERM], pytest.mark.faults)
)
def test_a_signal_ends_a_run_in_two_seconds(tmp_path: Path, number: int) -> None:
    logs = make_logs(tmp_path / "logs", 12, word="slow", spoilt=["", "", "", "hang"])
    store = tmp_path / "store"
    with start_coordinator(logs, store) as coordinator:
        assert coordinator.stdout is not None
        for _ in range(4):
            coordinator.stdout.readline()
        sent = time.monotonic()
        coordinator.send_signal(number)
        coordinator.communicate(timeout=60.0)
    assert time.monotonic() - sent < 2.0
    assert coordinator.returncode == 0
    assert not [path for path in store.rglob("*") if path.suffix == ".partial"]
    (logs / "unit_0" / "log_0003.csv").write_text("n3 slow \n")
    assert run_toys(logs, store)[0].computed < 12
    rows = contents(store)["rows"]
    assert rows == undisturbed(logs, tmp_path / "calm")["rows"]


def test_an_interrupted_run_tells_what_it_did_and_goes_on(tmp_path: Path) -> None:
    logs, store = make_logs(tmp_path / "logs", 12, word="slow"), tmp_path / "store"

    def interrupt(event: Any) -> None:
        events.append(event)
        if len(events) == 4:
            raise KeyboardInterrupt

    events: list[Any] = []
    summary, _ = run_toys(logs, store, interrupt, workers=2)
    assert not summary.complete
    assert 0 < len(contents(store)["rows"]) < 12
    assert run_toys(logs, store)[0].complete
    assert contents(store) == undisturbed(logs, tmp_path / "calm")


def test_no_worker_outlives_its_coordinator(tmp_path: Path) -> None:
    logs = make_logs(tmp_path / "logs", 4, word="hang")
    with start_coordinator(logs, tmp_path / "store") as coordinator:
        deadline = time.monotonic() + 20.0
        while len(workers := children(coordinator.pid)) < 2 and time.monotonic() < deadline:
            time.sleep(0.02)
        coordinator.kill()
    while any(map(alive, workers)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert workers
    assert not any(map(alive, workers))


def alive(pid: int) -> bool:
    """Whether a process runs (a dead one may still be listed)."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
