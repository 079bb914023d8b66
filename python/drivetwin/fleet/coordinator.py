# SPDX-License-Identifier: MIT
"""The one process that leads a run: it gives out tasks, writes the index, and loses nothing."""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Generator
from contextlib import closing
from dataclasses import dataclass
from time import monotonic

from drivetwin.errors import StoreError, Where
from drivetwin.fleet.events import Listener, Retried, Settled, Started, Summary
from drivetwin.fleet.index import FileRow
from drivetwin.fleet.pool import Pool
from drivetwin.fleet.scan import Scan, Scanned, Skipped, settings_document
from drivetwin.fleet.sources import Sources
from drivetwin.fleet.store import Store
from drivetwin.fleet.task import Finished, Lost, Outcome, Recipe, Reply, State, Stopped, Task

_COMMIT_EVERY = 1.0
"""Time [s] after which what was learnt is made last. A run that is killed does not compute more
than this again, and not even that: the parts tell their outcome."""
_TICK = 0.2
_BACK_OFF = 0.5
"""First wait [s] after the loss of a worker; it doubles with every further loss of the log."""


@dataclass(frozen=True)
class Wishes:
    """Options of a fleet run.

    `attempts` is the number of tries of a log after lost workers. `retry` selects the quarantined
    logs. The other fields request single reports and traces.
    """

    attempts: int = 3
    retry: bool = False
    reports: bool = False
    traces: bool = False


class Coordinator:
    """Scheduler of one run: `run` processes the files of `sources` into `store`."""

    def __init__(self, store: Store, pool: Pool, wishes: Wishes, tell: Listener) -> None:
        self._store = store
        self._index = store.index
        self._pool = pool
        self._wishes = wishes
        self._tell = tell
        self._out: dict[str, list[FileRow]] = {}
        self._tries: Counter[str] = Counter()
        self._later: list[tuple[float, str, Task]] = []
        self._states: Counter[State] = Counter()
        self._failures: Counter[str] = Counter()
        self._skipped = self._computed = 0
        self._committed = monotonic()
        self._settings: set[str] = set()

    def run(self, scan: Scan, sources: Sources) -> Summary:
        """Process every file. Raises StoreError if the store cannot be written.

        Whatever ends it early, the index holds what was learnt until then.
        """
        started = monotonic()
        files = sources.count()
        self._tell(Started(files, str(self._store.folder), self._pool.address))
        try:
            with closing(self._tasks(scan, sources)) as tasks:
                self._work(tasks)
            complete = True
            self._store.compact()
        except KeyboardInterrupt:
            complete = False
        finally:
            self._index.commit()
        state = self._states
        summary = Summary(
            files, state[State.DONE], state[State.BAD], state[State.QUARANTINED], self._skipped,
            self._computed, monotonic() - started, complete, dict(self._failures.most_common()),
        )  # fmt: skip
        self._tell(summary)
        return summary

    def _work(self, tasks: Generator[Task]) -> None:
        more = True
        while more or self._out:
            while len(self._out) - len(self._later) < self._pool.capacity:
                task = self._due()
                if task is None and more and len(self._later) < self._pool.capacity:
                    task = next(tasks, None)
                    more = task is not None
                if task is None:
                    break
                self._pool.submit(task)
            answer = self._pool.next(_TICK)
            if answer is not None:
                self._take(*answer)
            self._commit_if_due()

    def _due(self) -> Task | None:
        """Return the next task to retry, unless its lost worker has written the result."""
        while self._later and self._later[0][0] <= monotonic():
            task = heapq.heappop(self._later)[2]
            outcome = self._store.written(task.log)
            if outcome is None or self._store.misses(task):
                return task
            self._finish(task, Finished(outcome, 0.0))
        return None

    def _commit_if_due(self) -> None:
        if monotonic() - self._committed > _COMMIT_EVERY:
            self._index.commit()
            self._committed = monotonic()

    def _tasks(self, scan: Scan, sources: Sources) -> Generator[Task]:
        """Tasks of the files that still need work; the others are settled on the way."""
        with closing(scan.scanned(sources, self._index.file)) as found:
            for one in found:
                self._commit_if_due()
                if isinstance(one, Skipped):
                    self._skipped += 1
                elif not self._index.seen_in_this_run(one.file.path):
                    self._index.put_file(one.file)
                    task = self._task(one)
                    if task is not None:
                        yield task

    def _task(self, one: Scanned) -> Task | None:
        """Create the task of a file; None if its outcome exists or its task is in flight."""
        file = one.file
        version = "" if one.recipe is None else one.recipe.version
        if one.recipe is not None and one.settings not in self._settings:
            self._settings.add(one.settings)
            self._index.put_settings(one.settings, version, settings_document(one.recipe))
        if file.log in self._out:
            self._out[file.log].append(file)
            return None
        self._index.put_waiting(file.log, file.content, one.settings, version)
        if one.recipe is None:
            assert one.fault is not None
            self._settle(file.log, [file], Finished(one.fault, 0.0), computed=False)
            return None
        task = self._task_of(file, one.recipe)
        if self._known(task, file):
            return None
        self._out[file.log] = [file]
        return task

    def _task_of(self, file: FileRow, recipe: Recipe) -> Task:
        store, log = self._store, file.log
        return Task(
            log, file.path, file.content, recipe, str(store.part(log)),
            report=str(store.report(log)) if self._wishes.reports else None,
            traces=str(store.traces(log)) if self._wishes.traces else None,
        )  # fmt: skip

    def _known(self, task: Task, file: FileRow) -> bool:
        """Reuse the stored outcome of a log if all its files exist; return True if reused."""
        log = task.log
        state = self._index.state(log)
        if state is State.QUARANTINED and self._wishes.retry:
            self._index.reset([log])
            return False
        if state is State.WAITING:
            outcome = self._store.written(log)
            if outcome is None or (outcome.state is State.DONE and self._store.misses(task)):
                return False
            self._settle(log, [file], Finished(outcome, 0.0), computed=False)
            return True
        if state is State.DONE and self._store.misses(task):
            return False
        self._announce(file, self._index.outcome(log), 0.0, computed=False)
        return True

    def _take(self, task: Task, reply: Reply) -> None:
        """Handle the reply of a worker."""
        if isinstance(reply, Stopped):
            raise StoreError(reply.what, reply.remedy, Where(file=str(self._store.folder)))
        if isinstance(reply, Lost):
            self._lost(task, reply)
            return
        self._tries[task.log] += 1
        self._finish(task, reply)

    def _finish(self, task: Task, reply: Finished) -> None:
        self._index.put_attempts(task.log, self._tries.pop(task.log, 0))
        self._settle(task.log, self._out.pop(task.log), reply, computed=True)

    def _lost(self, task: Task, loss: Lost) -> None:
        """Schedule a retry of a log, or quarantine the log after too many lost workers."""
        wait = 0.0
        if loss.blame:
            self._tries[task.log] += 1
            tries = self._tries[task.log]
            if tries >= self._wishes.attempts:
                self._finish(task, Finished(_worker_killer(tries, loss.reason), 0.0))
                return
            wait = _BACK_OFF * 2.0 ** (tries - 1)
        heapq.heappush(self._later, (monotonic() + wait, task.log, task))
        self._tell(Retried(task.log, loss.reason, wait))

    def _settle(self, log: str, files: list[FileRow], reply: Finished, *, computed: bool) -> None:
        self._index.put_outcome(log, reply.outcome, reply.seconds)
        self._computed += computed
        for file in files:
            self._announce(file, reply.outcome, reply.seconds, computed=computed)

    def _announce(self, file: FileRow, outcome: Outcome, seconds: float, *, computed: bool) -> None:
        self._states[outcome.state] += 1
        if outcome.error:
            self._failures[outcome.error] += 1
        self._tell(
            Settled(
                file.path,
                file.log,
                file.unit,
                outcome.state,
                computed,
                seconds,
                outcome.error,
                outcome.what,
            )
        )


def _worker_killer(tries: int, reason: str) -> Outcome:
    return Outcome(
        State.QUARANTINED,
        error="WorkerLost",
        what=f"its worker was lost {tries} times; the last one {reason}",
        remedy="try `drivetwin identify` on the log; run again with --retry if the machine was "
        "to blame",
    )
