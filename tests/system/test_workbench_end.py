# SPDX-License-Identifier: MIT
"""The end of the program: no child process and no temporary folder is left, whatever ends it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from tests.support.repeats import mark_repeats

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="children are listed in /proc")

SIGNALS = ("SIGHUP", "SIGTERM", "SIGINT", "SIGKILL")
Started = Callable[[], subprocess.Popen[str]]

_BUSY = """
import signal, sys, threading, time
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # whoever runs the tests may ignore both
signal.signal(signal.SIGINT, signal.default_int_handler)
from drivetwin.workbench import jobs, server
from tests.system.test_workbench_end import sleep_long
begin, end = server.start_server, jobs.end_all

def wait_for_job():
    # A request that waits for a job, as one that opens a log does: in a daemon of the server.
    limit = {"limit": 300.0}
    threading.Thread(target=jobs.call, args=(sleep_long,), kwargs=limit, daemon=True).start()

def start(*given):
    made = begin(*given)
    jobs.start(sleep_long)
    wait_for_job()
    return made

def end_all():
    end()
    wait_for_job()  # a request that comes late

server.start_server, jobs.end_all = start, end_all
sys.argv = ["drivetwin", "app", "--port", "0", "--no-browser"]
from drivetwin.__main__ import main
sys.exit(main())
"""


def sleep_long(_: object) -> None:
    """A job that does not end by itself."""
    time.sleep(300.0)


@pytest.fixture
def started(tmp_path: Path) -> Iterator[Started]:
    """Start of the program with two jobs; all that a failed test leaves is killed."""
    processes: list[subprocess.Popen[str]] = []

    def start() -> subprocess.Popen[str]:
        processes.append(_start(tmp_path))
        assert len(_wait_for(processes[-1].pid, 3)) >= 3
        return processes[-1]

    yield start
    for process in processes:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


def _start(folder: Path) -> subprocess.Popen[str]:
    environment = {
        **os.environ,
        "TMPDIR": str(folder),
        "PYTHONPATH": os.pathsep.join(one for one in sys.path if one),
    }
    process = subprocess.Popen(
        [sys.executable, "-c", _BUSY], cwd=folder, env=environment, text=True,
        stdout=subprocess.PIPE, start_new_session=True,
    )  # fmt: skip
    assert process.stdout is not None
    assert "token" in process.stdout.readline()
    return process


def _wait_for(leader: int, count: int) -> set[int]:
    """Wait until a session has at least `count` processes."""
    end = time.monotonic() + 20.0
    while len(found := _list_session(leader)) < count and time.monotonic() < end:
        time.sleep(0.1)
    return found


def _list_session(leader: int) -> set[int]:
    """Living processes of the session that a process leads."""
    found = set()
    for one in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, session = one.read_text().rpartition(")")[2].split()[:4]
        except OSError:
            continue
        if int(session) == leader and state != "Z":
            found.add(int(one.parent.name))
    return found


def _wait_for_none(leader: int) -> set[int]:
    end = time.monotonic() + 20.0
    while (left := _list_session(leader)) and time.monotonic() < end:
        time.sleep(0.1)
    return left


@pytest.mark.parametrize("sent", mark_repeats(SIGNALS, ("SIGTERM",), pytest.mark.faults))
def test_nothing_is_left(tmp_path: Path, started: Started, sent: str) -> None:
    process = started()
    process.send_signal(signal.Signals[sent])
    process.communicate(timeout=30.0)
    assert _wait_for_none(process.pid) == set()
    if sent != "SIGKILL":
        assert process.returncode == 0
        assert list(tmp_path.glob(".drivetwin-*")) == []


@pytest.mark.faults
def test_a_closed_terminal_signals_the_group_twice(tmp_path: Path, started: Started) -> None:
    process = started()
    for _ in range(2):
        os.killpg(process.pid, signal.SIGHUP)
    process.communicate(timeout=30.0)
    assert _wait_for_none(process.pid) == set()
    assert list(tmp_path.glob(".drivetwin-*")) == []


def test_the_next_start_removes_what_a_killed_run_left(tmp_path: Path, started: Started) -> None:
    killed = started()
    killed.kill()
    killed.communicate()
    (left,) = tmp_path.glob(".drivetwin-*")
    following = started()
    assert not left.exists()
    following.send_signal(signal.SIGHUP)
    following.communicate(timeout=30.0)
    assert list(tmp_path.glob(".drivetwin-*")) == []
