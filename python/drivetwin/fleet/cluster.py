# SPDX-License-Identifier: MIT
"""Tasks on a Dask cluster that runs already; the scheduler may go away and come back.

Each thread of a Dask worker guards a process of its own, as on one machine: limits of time and
memory hold there too, and a log that kills its process does not kill the Dask worker.
"""

from __future__ import annotations

import contextlib
import threading
from concurrent.futures import CancelledError
from pathlib import Path
from queue import Empty, SimpleQueue
from time import monotonic, sleep
from typing import Any
from uuid import uuid4

from drivetwin._util.optional_dependencies import import_extra
from drivetwin.errors import SchedulerError, Where
from drivetwin.fleet.pool import AHEAD, GuardedWorker
from drivetwin.fleet.task import Listener, Noted, Reply, Task, WorkerLost, WorkerSpec

_FIRST_CONTACT = 10.0
"""Time [s] in which a scheduler must answer at the start ..."""
_PATIENCE = 600.0
"""... and in which one that went away may come back."""
_PAUSE = 1.0
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
        self._distributed = _import_distributed_quietly(address)
        self._scheduler = address
        self._spec = spec
        self._tell = tell
        self._patience = patience
        self._replies: SimpleQueue[tuple[int, Any]] = SimpleQueue()
        self._out: dict[int, tuple[Task, Any]] = {}
        self._submitted = 0
        # Dask takes tasks of one key for one task: two runs of the same logs must not share them.
        self._run = uuid4().hex
        self._client = self._connect(_FIRST_CONTACT)
        self._counted = 0.0
        self._threads = 0

    @property
    def address(self) -> str | None:
        """Of the cluster's dashboard."""
        link = self._client.dashboard_link
        return None if link is None else str(link)

    @property
    def capacity(self) -> int:
        """As many tasks as keep the cluster's threads busy; without workers none."""
        if monotonic() - self._counted > _COUNT_EVERY or not self._threads:
            self._counted = monotonic()
            with contextlib.suppress(OSError, TimeoutError):
                self._threads = sum(self._client.nthreads().values())
        return AHEAD * self._threads

    def submit(self, task: Task) -> None:
        """Give out a task."""
        self._submitted += 1
        number = self._submitted
        self._out[number] = (task, None)
        try:
            future = self._client.submit(
                run_guarded, task.to_json(), self._spec, key=f"{task.log}-{self._run}-{number}",
                pure=False, retries=0,
            )  # fmt: skip
        except Exception as fault:
            # The client raises many types when its scheduler is gone; `next` then reconnects.
            self._replies.put((number, fault))
            return
        self._out[number] = (task, future)
        future.add_done_callback(lambda done: self._replies.put((number, done)))

    def next(self, timeout: float) -> tuple[Task, Reply] | None:
        """Return the next reply, or None after `timeout` [s].

        Raises SchedulerError where the scheduler stays away.
        """
        try:
            number, done = self._replies.get(timeout=timeout)
        except Empty:
            if self._client.status != "running":
                self._reconnect()
            return None
        task, _ = self._out.pop(number, (None, None))
        if task is None:  # cancelled before, and submitted again
            return None
        if isinstance(done, Exception):
            return task, WorkerLost("the scheduler went away", blame=False)
        return task, _get_reply(done)

    def close(self) -> None:
        """Give back what is not done and leave the cluster."""
        with contextlib.suppress(Exception):
            self._client.cancel(
                [future for _, future in self._out.values() if future is not None], force=True
            )
        self._disconnect()

    def _disconnect(self) -> None:
        with contextlib.suppress(Exception):
            self._client.close(timeout=2.0)

    def _connect(self, patience: float) -> Any:
        deadline = monotonic() + patience
        while True:
            try:
                return self._distributed.Client(
                    self._scheduler, timeout=min(patience, _FIRST_CONTACT), set_as_default=False
                )
            except (OSError, TimeoutError, ValueError) as fault:
                if monotonic() > deadline or isinstance(fault, ValueError):
                    raise SchedulerError(
                        f"no Dask scheduler answers within {patience:g} s",
                        "start it, or check the address; the same command goes on from here",
                        Where(file=self._scheduler),
                    ) from None
                sleep(_PAUSE)

    def _reconnect(self) -> None:
        """Wait for a scheduler, and submit all tasks in flight again."""
        self._tell(Noted(f"lost the scheduler at {self._scheduler}; waiting for it"))
        self._disconnect()
        self._client = self._connect(self._patience)
        for number in self._out:
            self._replies.put((number, ConnectionError()))
        self._threads = 0
        self._tell(Noted("the scheduler is back"))


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
