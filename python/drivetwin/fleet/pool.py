# SPDX-License-Identifier: MIT
"""Worker pools: the processes of this machine, and a Dask cluster that runs already.

A worker process is guarded: it receives a log and is stopped when it exceeds its limits.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import subprocess
import sys
import tempfile
import threading
from concurrent.futures import CancelledError
from pathlib import Path
from queue import Empty, SimpleQueue
from time import monotonic
from typing import IO, Any
from uuid import uuid4

from drivetwin._util.child_process import (
    BY_ITSELF,
    GRACE,
    describe_end,
    end_process,
)
from drivetwin._util.optional_dependencies import import_extra
from drivetwin.errors import SchedulerError, Where
from drivetwin.fleet.task import (
    Aborted,
    Completed,
    Limits,
    Listener,
    Noted,
    Outcome,
    Reply,
    State,
    Task,
    WorkerLost,
    WorkerSpec,
    make_memory_outcome,
)

_LOOK = 0.1
"""Time [s] between two looks at a worker's memory."""
_START = 120.0
"""Time [s] that a worker may take to import what it needs; a cold network drive is slow."""
ONE_THREAD = {
    f"{library}_NUM_THREADS": "1"
    for library in ("OPENBLAS", "OMP", "MKL", "VECLIB", "NUMEXPR", "RAYON")
}
"""Environment in which libraries with threads of their own have one each, since the logs are what
runs side by side.
"""
_TRIMMING = "MALLOC_TRIM_THRESHOLD_"
"""A Dask nanny sets it for the Dask worker, so that freed memory goes back to the system at once. A
worker of ours would get the same pages back with the next array, which costs some per cent."""

_PAUSES = (0.1, 0.2, 0.5, 1.0, 2.0, 4.0, 8.0)
"""Time [s] to wait after each worker that was killed before it was ready."""


class _GoneError(Exception):
    """The worker ended without an answer."""


class GuardedWorker:
    """Worker process, started on demand and restarted after its end.

    For use by one thread; only `kill` may be called by others.
    """

    def __init__(self, spec: WorkerSpec) -> None:
        self._spec = spec
        self._process: subprocess.Popen[bytes] | None = None
        self._stderr: IO[bytes] | None = None
        self._pending = b""
        self._closed = threading.Event()

    def run(self, task: Task) -> Reply:
        """Run a task within the limits. Errors of log or worker are returned, not raised."""
        limits = self._spec.limits
        if fault := self._start():
            return fault
        try:
            self._send(task)
            reply = self._read_line(monotonic() + limits.seconds, limits.memory)
        except _GoneError:
            return WorkerLost(self._stop_process(GRACE))
        if isinstance(reply, Outcome):
            self._stop_process()
            return Completed(reply, limits.seconds)
        tree = json.loads(reply)
        if "stop" in tree:
            return Aborted(tree["stop"], tree["remedy"])
        return Completed(Outcome.from_tree(tree["outcome"]), tree["seconds"])

    def kill(self) -> None:
        """End a log in progress, from any thread; no worker is made again."""
        self._closed.set()  # before the look at the process, see `_start`
        process = self._process
        if process is not None:
            process.kill()

    def close(self) -> None:
        """End the worker, if there is one, from the thread that uses the cell."""
        self._closed.set()
        if self._process is not None:
            self._stop_process()

    def _start(self) -> WorkerLost | Aborted | None:
        """Start a worker and wait until it is ready; a failed start is not counted against the log.

        One that ends by itself will do so again; one that was killed may have been unlucky.
        """
        why = ""
        for pause in _PAUSES:
            if self._closed.is_set():
                return WorkerLost("the run was ended", blame=False)
            if self._process is not None:
                return None
            try:
                self._spawn()
                if self._closed.is_set():  # `kill` came before there was a process to end
                    self._stop_process()
                    continue
                if not isinstance(self._read_line(monotonic() + _START, sys.maxsize), Outcome):
                    return None
                why = self._stop_process()
            except _GoneError:
                why = self._stop_process(GRACE)
            except OSError as fault:
                why = str(fault.strerror)
            if why.startswith(BY_ITSELF):
                break
            self._closed.wait(pause)
        return Aborted(
            f"no worker starts: it {why}", "see whether 'drivetwin identify' runs on this machine"
        )

    def _spawn(self) -> None:
        self._stderr = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the worker
        self._pending = b""
        inherited = {name: value for name, value in os.environ.items() if name != _TRIMMING}
        arguments = (self._spec.function, str(self._spec.limits.memory))
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "drivetwin.fleet.worker", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._stderr,
            env={**inherited, **ONE_THREAD},
            start_new_session=True,  # an interrupt at the keyboard is the coordinator's alone
        )

    def _send(self, task: Task) -> None:
        assert self._process is not None
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # detected by the end of the answer
            self._process.stdin.write(task.to_json().encode() + b"\n")
            self._process.stdin.flush()

    def _read_line(self, deadline: float, memory: int) -> bytes | Outcome:
        """The worker's next line, or what it went beyond. Raises _GoneError at its end."""
        assert self._process is not None
        assert self._process.stdout is not None
        handle = self._process.stdout.fileno()
        while b"\n" not in self._pending:
            ready, _, _ = select.select([handle], [], [], _LOOK)
            if ready:
                data = os.read(handle, 1 << 16)
                if not data:
                    raise _GoneError
                self._pending += data
            elif monotonic() > deadline:
                return make_timeout_outcome(self._spec.limits)
            elif _read_resident_memory(self._process.pid) > memory:
                return make_memory_outcome(memory)
        line, _, self._pending = self._pending.partition(b"\n")
        return line

    def _stop_process(self, grace: float = 0.0) -> str:
        """End the worker for good, after `grace` [s] to end by itself; how it ended."""
        process, self._process = self._process, None
        assert process is not None
        code = end_process(process, grace)
        assert self._stderr is not None
        with self._stderr as written:
            return describe_end(code, written)


def make_timeout_outcome(limits: Limits) -> Outcome:
    """Return the outcome of a log that exceeded the time limit."""
    return Outcome(
        State.QUARANTINED,
        error="TimeLimit",
        what=f"it was not done after {limits.seconds:g} s",
        remedy="look at the log with 'drivetwin inspect'; "
        "run again with --retry and a larger --time-limit if it is only long",
    )


def _read_resident_memory(pid: int) -> int:
    """Read the resident memory [bytes] of a process; 0 if the system does not report it."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, IndexError, ValueError):
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE")


AHEAD = 2
"""Tasks given out for each worker: one at work, one at hand. More would only fill memory."""


def count_usable_cores() -> int:
    """Processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class LocalPool:
    """Worker processes of this machine, each with a supervising thread."""

    address = None

    def __init__(self, workers: int, spec: WorkerSpec) -> None:
        self.capacity = AHEAD * workers
        self._tasks: SimpleQueue[Task | None] = SimpleQueue()
        self._replies: SimpleQueue[tuple[Task, Reply]] = SimpleQueue()
        self._cells = [GuardedWorker(spec) for _ in range(workers)]
        self._threads = [
            threading.Thread(target=self._run_tasks, args=(cell,), daemon=True)
            for cell in self._cells
        ]
        for thread in self._threads:
            thread.start()

    def _run_tasks(self, cell: GuardedWorker) -> None:
        while (task := self._tasks.get()) is not None:
            self._replies.put((task, cell.run(task)))
        cell.close()

    def submit(self, task: Task) -> None:
        """Give out a task."""
        self._tasks.put(task)

    def next(self, timeout: float) -> tuple[Task, Reply] | None:
        """The next answer, None where none comes within `timeout` [s]."""
        try:
            return self._replies.get(timeout=timeout)
        except Empty:
            return None

    def close(self) -> None:
        """End all workers at once."""
        for _ in self._threads:
            self._tasks.put(None)
        for cell in self._cells:
            cell.kill()
        for thread in self._threads:
            thread.join()


_FIRST_CONTACT = 10.0
"""Time [s] in which a scheduler must answer at the start ..."""
_PATIENCE = 600.0
"""... and in which one that went away may come back."""
_COUNT_EVERY = 5.0
"""Time [s] after which the cluster's threads are counted anew: it may grow and shrink."""

_cells = threading.local()


def run_guarded(task: str, spec: WorkerSpec) -> Reply:
    """Run a task on a Dask worker, in the guarded process of this thread."""
    if getattr(_cells, "spec", None) != spec:
        _cells.spec, _cells.cell = spec, GuardedWorker(spec)
    cell: GuardedWorker = _cells.cell
    return cell.run(Task.from_json(task))


class DaskPool:
    """A running Dask cluster by the address of its scheduler.

    Raises MissingExtraError without Dask and SchedulerError where the scheduler does not answer.
    """

    def __init__(
        self, address: str, spec: WorkerSpec, tell: Listener, patience: float = _PATIENCE
    ) -> None:
        client = _import_distributed_quietly(address).Client
        self._scheduler, self._spec, self._tell = address, spec, tell
        self._replies: SimpleQueue[tuple[Task, Any]] = SimpleQueue()
        self._out: set[Any] = set()
        self._is_away = False
        self._counted = 0.0
        self._threads = 0
        try:
            client(address, timeout=_FIRST_CONTACT, set_as_default=False).close()
            self._client = client(address, timeout=patience, set_as_default=False)
        except (OSError, TimeoutError, ValueError):
            raise self._make_absence_error() from None

    @property
    def address(self) -> str | None:
        """Of the cluster's dashboard."""
        link = self._client.dashboard_link
        return None if link is None else str(link)

    @property
    def capacity(self) -> int:
        """As many tasks as keep the cluster's threads busy; without workers none."""
        if self._client.status != "running":
            return 0
        if monotonic() - self._counted > _COUNT_EVERY or not self._threads:
            self._counted = monotonic()
            with contextlib.suppress(OSError, TimeoutError):
                self._threads = sum(self._client.nthreads().values())
        return AHEAD * self._threads

    def submit(self, task: Task) -> None:
        """Give out a task."""
        # Dask takes tasks of one key for one task: two runs of the same logs must not share them.
        future = self._client.submit(
            run_guarded, task.to_json(), self._spec, key=f"{task.log}-{uuid4().hex}",
            pure=False, retries=0,
        )  # fmt: skip
        self._out.add(future)
        future.add_done_callback(lambda done: self._replies.put((task, done)))

    def next(self, timeout: float) -> tuple[Task, Reply] | None:
        """Return the next reply, or None after `timeout` [s].

        A client that loses its scheduler cancels its tasks and connects again by itself. Raises
        SchedulerError where the scheduler stays away.
        """
        status = self._client.status
        if status == "closed":
            raise self._make_absence_error()
        if self._is_away is (status == "running"):
            self._is_away = not self._is_away
            lost = f"lost the scheduler at {self._scheduler}; waiting for it"
            self._tell(Noted(lost if self._is_away else "the scheduler is back"))
        try:
            task, done = self._replies.get(timeout=timeout)
        except Empty:
            return None
        self._out.discard(done)
        return task, _get_reply(done)

    def close(self) -> None:
        """Give back what is not done and leave the cluster."""
        with contextlib.suppress(Exception):
            self._client.cancel(list(self._out), force=True)
        with contextlib.suppress(Exception):
            self._client.close(timeout=2.0)

    def _make_absence_error(self) -> SchedulerError:
        return SchedulerError(
            "no Dask scheduler answers",
            "start it, or check the address; the same command goes on from here",
            Where(file=self._scheduler),
        )


def _import_distributed_quietly(address: str) -> Any:
    """Import Dask with its connection-loss log messages disabled; the run reports such losses."""
    dask = import_extra("dask", "fleet", "a Dask cluster", Path(address))
    silent = {"distributed": "critical", "distributed.client": "critical"}
    dask.config.set({"logging": silent})
    return import_extra("distributed", "fleet", "a Dask cluster", Path(address))


def _get_reply(done: Any) -> Reply:
    """Return the reply of a finished Dask future."""
    try:
        if done.status == "finished":
            reply: Reply = done.result(timeout=_FIRST_CONTACT)
            return reply
        if done.status == "error":
            fault = done.exception(timeout=_FIRST_CONTACT)
            return WorkerLost(f"was lost by the cluster ({type(fault).__name__}: {fault})"[:300])
    except (OSError, TimeoutError, CancelledError):
        return WorkerLost("the scheduler went away with the answer", blame=False)
    return WorkerLost("the cluster took the task back", blame=False)


Pool = LocalPool | DaskPool
"""Takes tasks and answers them in any order; its `capacity` tasks may be in flight."""
