# SPDX-License-Identifier: MIT
"""Worker pools: the interface used by the coordinator, and the processes of this machine."""

from __future__ import annotations

import os
import threading
from queue import Empty, SimpleQueue
from typing import Protocol

from drivetwin.fleet.guarded_worker import GuardedWorker
from drivetwin.fleet.task import Reply, Task, WorkerSpec

AHEAD = 2
"""Tasks given out for each worker: one at work, one at hand. More would only fill memory."""


class Pool(Protocol):
    """Takes tasks and answers them in any order."""

    @property
    def capacity(self) -> int:
        """Maximum number of tasks in flight."""

    @property
    def address(self) -> str | None:
        """Address of the pool's dashboard, if any."""

    def submit(self, task: Task) -> None:
        """Give out a task."""

    def next(self, timeout: float) -> tuple[Task, Reply] | None:
        """Return the next reply, or None after `timeout` [s]."""

    def close(self) -> None:
        """End all work at once."""


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
