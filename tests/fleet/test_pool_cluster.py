# SPDX-License-Identifier: MIT
"""A Dask cluster in processes of its own: work, a scheduler that dies and comes back."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from drivetwin.errors import SchedulerError
from tests.fleet.test_coordinator_faults import COUNT, undisturbed
from tests.fleet.toys import ROOT, contents, make_logs, run_toys

pytest.importorskip("distributed")


def free_port() -> int:
    """A port that nobody listens at now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def process(*arguments: str) -> Iterator[subprocess.Popen[bytes]]:
    """A part of the cluster, killed at the end of the block."""
    command = [sys.executable, "-m", *arguments]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as running:
        try:
            yield running
        finally:
            running.kill()


def scheduler(port: int) -> tuple[str, ...]:
    """Command of a scheduler."""
    return (
        "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port),
        "--no-dashboard",
    )  # fmt: skip


def worker(port: int) -> tuple[str, ...]:
    """Command of a worker with two threads."""
    return (
        "distributed.cli.dask_worker", f"tcp://127.0.0.1:{port}", "--nthreads", "2", "--no-nanny",
        "--no-dashboard", "--death-timeout", "60",
    )  # fmt: skip


@pytest.mark.faults
def test_a_scheduler_lost_and_restarted_costs_nothing(tmp_path: Path) -> None:
    logs = make_logs(tmp_path / "logs", COUNT, word="slow", spoilt=["bad"])
    store, port = tmp_path / "store", free_port()
    command = [sys.executable, "-m", "tests.fleet.toys", str(logs), str(store)]
    command += [f"tcp://127.0.0.1:{port}"]
    with ExitStack() as cluster:
        first = cluster.enter_context(process(*scheduler(port)))
        cluster.enter_context(process(*worker(port)))
        run = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE)
        cluster.callback(run.wait)
        cluster.callback(run.kill)
        assert run.stdout is not None
        cluster.callback(run.stdout.close)
        timer = threading.Timer(100.0 + 2.0 * COUNT, run.kill)
        cluster.callback(timer.cancel)
        timer.start()
        events = []
        for line in run.stdout:
            events.append(json.loads(line))
            if first.poll() is None and len(events) > COUNT // 3:
                first.kill()
                first.wait()
                cluster.enter_context(process(*scheduler(port)))
                cluster.enter_context(process(*worker(port)))
        assert run.wait() == 0
    notes = [event["text"] for event in events if event["event"] == "note"]
    assert any("lost the scheduler" in text for text in notes)
    assert events[-1]["event"] == "summary"
    assert events[-1]["complete"]
    assert contents(store) == undisturbed(logs, tmp_path / "calm")


def test_a_scheduler_that_is_not_there_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("drivetwin.fleet.pool._FIRST_CONTACT", 1.0)
    logs, started = make_logs(tmp_path / "logs", 1), time.monotonic()
    with pytest.raises(SchedulerError, match="no Dask scheduler answers"):
        run_toys(logs, tmp_path / "store", scheduler=f"tcp://127.0.0.1:{free_port()}")
    assert time.monotonic() - started < 20.0


@pytest.mark.faults
def test_two_runs_over_the_same_logs_share_a_cluster_and_no_task(tmp_path: Path) -> None:
    logs, port = make_logs(tmp_path / "logs", COUNT, word="slow"), free_port()
    stores = tmp_path / "one", tmp_path / "other"
    with ExitStack() as cluster:
        cluster.enter_context(process(*scheduler(port)))
        cluster.enter_context(process(*worker(port)))
        runs = [
            cluster.enter_context(
                process("tests.fleet.toys", str(logs), str(store), f"tcp://127.0.0.1:{port}")
            )
            for store in stores
        ]
        assert [run.wait(100.0) for run in runs] == [0, 0]
    assert contents(stores[0]) == contents(stores[1]) == undisturbed(logs, tmp_path / "calm")
