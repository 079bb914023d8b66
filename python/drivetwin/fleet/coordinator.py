# SPDX-License-Identifier: MIT
"""The one process that leads a run: it gives out tasks, writes the index, and loses nothing.

Its workers are processes of this machine, or of a cluster.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Generator, Sequence
from contextlib import closing
from pathlib import Path
from time import monotonic

from drivetwin.errors import StoreError, Where
from drivetwin.fleet.options import FleetOptions
from drivetwin.fleet.pool import DaskPool, LocalPool, Pool, count_usable_cores
from drivetwin.fleet.rules import RulesFile, Sources
from drivetwin.fleet.scan import Scan, Scanned, make_settings_document
from drivetwin.fleet.store import FileRow, Store
from drivetwin.fleet.task import (
    IDENTIFY,
    Aborted,
    Completed,
    Limits,
    Listener,
    Member,
    Outcome,
    Reply,
    Retried,
    Settled,
    Started,
    State,
    Summary,
    Task,
    TaskSpec,
    WorkerLost,
    WorkerSpec,
)

_COMMIT_EVERY = 1.0
"""Time [s] between commits of the index. A killed run repeats no more work than this; finished
parts are not repeated, because they contain their outcome."""
_TICK = 0.2
_BACK_OFF = 0.5
"""First wait [s] after the loss of a worker; it doubles with every further loss of the log."""


class Coordinator:
    """Scheduler of one run: `run` processes the files of `sources` into `store`."""

    def __init__(self, store: Store, pool: Pool, options: FleetOptions, tell: Listener) -> None:
        self._store = store
        self._index = store.index
        self._pool = pool
        self._options = options
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
            with closing(self._iterate_tasks(scan, sources)) as tasks:
                self._run_tasks(tasks)
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

    def _run_tasks(self, tasks: Generator[Task]) -> None:
        more = True
        while more or self._out:
            while len(self._out) - len(self._later) < self._pool.capacity:
                task = self._get_due_task()
                if task is None and more and len(self._later) < self._pool.capacity:
                    task = next(tasks, None)
                    more = task is not None
                if task is None:
                    break
                self._pool.submit(task)
            answer = self._pool.next(_TICK)
            if answer is not None:
                self._handle_reply(*answer)
            self._commit_if_due()

    def _get_due_task(self) -> Task | None:
        """Return the next task to retry, unless its lost worker has written the result."""
        while self._later and self._later[0][0] <= monotonic():
            task = heapq.heappop(self._later)[2]
            outcome = self._store.read_part_outcome(task.log)
            if outcome is None or self._store.is_report_missing(task):
                return task
            self._record_completion(task, Completed(outcome, 0.0))
        return None

    def _commit_if_due(self) -> None:
        if monotonic() - self._committed > _COMMIT_EVERY:
            self._index.commit()
            self._committed = monotonic()

    def _iterate_tasks(self, scan: Scan, sources: Sources) -> Generator[Task]:
        """Tasks of the files that still need work; the others are settled on the way."""
        with closing(scan.scan_files(sources, self._index.get_file)) as found:
            for one in found:
                self._commit_if_due()
                if one is None:
                    self._skipped += 1
                elif not self._index.has_file_from_this_run(one.file.path):
                    self._index.set_file(one.file)
                    task = self._make_task(one)
                    if task is not None:
                        yield task

    def _make_task(self, one: Scanned) -> Task | None:
        """Create the task of a file; None if its outcome exists or its task is in flight."""
        file = one.file
        version = "" if one.recipe is None else one.recipe.version
        if one.recipe is not None and one.settings not in self._settings:
            self._settings.add(one.settings)
            self._index.set_settings(one.settings, version, make_settings_document(one.recipe))
        if file.log in self._out:
            self._out[file.log].append(file)
            return None
        self._index.add_waiting_log(file.log, file.content, one.settings, version)
        if one.recipe is None:
            assert one.fault is not None
            self._record_outcome(file.log, [file], Completed(one.fault, 0.0), computed=False)
            return None
        task = self._build_task(file, one.recipe, one.members)
        if self._reuse_outcome(task, file):
            return None
        self._out[file.log] = [file]
        return task

    def _build_task(self, file: FileRow, recipe: TaskSpec, members: Sequence[Member]) -> Task:
        store, log = self._store, file.log
        return Task(
            log, file.path, file.content, recipe, str(store.get_part_path(log)),
            report=str(store.get_report_path(log)) if self._options.reports else None,
            members=tuple(members),
        )  # fmt: skip

    def _reuse_outcome(self, task: Task, file: FileRow) -> bool:
        """Reuse the stored outcome of a log if all its files exist; return True if reused."""
        log = task.log
        state = self._index.get_state(log)
        if state is State.QUARANTINED and self._options.retry:
            self._index.reset([log])
            return False
        if state is State.WAITING:
            outcome = self._store.read_part_outcome(log)
            if outcome is None or (
                outcome.state is State.DONE and self._store.is_report_missing(task)
            ):
                return False
            self._record_outcome(log, [file], Completed(outcome, 0.0), computed=False)
            return True
        if state is State.DONE and self._store.is_report_missing(task):
            return False
        self._notify_outcome(file, self._index.get_outcome(log), 0.0, computed=False)
        return True

    def _handle_reply(self, task: Task, reply: Reply) -> None:
        """Handle the reply of a worker."""
        if isinstance(reply, Aborted):
            raise StoreError(reply.what, reply.remedy, Where(file=str(self._store.folder)))
        if isinstance(reply, WorkerLost):
            self._handle_loss(task, reply)
            return
        self._tries[task.log] += 1
        self._record_completion(task, reply)

    def _record_completion(self, task: Task, reply: Completed) -> None:
        self._index.set_attempts(task.log, self._tries.pop(task.log, 0))
        self._record_outcome(task.log, self._out.pop(task.log), reply, computed=True)

    def _handle_loss(self, task: Task, loss: WorkerLost) -> None:
        """Schedule a retry of a log, or quarantine the log after too many lost workers."""
        wait = 0.0
        if loss.blame:
            self._tries[task.log] += 1
            tries = self._tries[task.log]
            if tries >= self._options.attempts:
                self._record_completion(
                    task, Completed(_make_quarantine_outcome(tries, loss.reason), 0.0)
                )
                return
            wait = _BACK_OFF * 2.0 ** (tries - 1)
        heapq.heappush(self._later, (monotonic() + wait, task.log, task))
        self._tell(Retried(task.log, loss.reason, wait))

    def _record_outcome(
        self, log: str, files: list[FileRow], reply: Completed, *, computed: bool
    ) -> None:
        self._index.set_outcome(log, reply.outcome, reply.seconds)
        self._computed += computed
        for file in files:
            self._notify_outcome(file, reply.outcome, reply.seconds, computed=computed)

    def _notify_outcome(
        self, file: FileRow, outcome: Outcome, seconds: float, *, computed: bool
    ) -> None:
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


def _make_quarantine_outcome(tries: int, reason: str) -> Outcome:
    return Outcome(
        State.QUARANTINED,
        error="WorkerLost",
        what=f"its worker was lost {tries} times; the last one {reason}",
        remedy="try 'drivetwin identify' on the log; run again with --retry if the machine was "
        "to blame",
    )


class FleetRun(FleetOptions):
    """Request of a fleet run: files, rules, folder of the store, and options.

    `function` identifies a log; see `WorkerSpec`.
    """

    sources: Sources
    rules: RulesFile
    store: Path
    function: str = IDENTIFY

    @property
    def worker(self) -> WorkerSpec:
        """Function and limits of a worker."""
        return WorkerSpec(self.function, Limits(self.time_limit, self.memory_limit))


def run_fleet(request: FleetRun, tell: Listener = lambda _: None) -> Summary:
    """Identify all logs that the store does not hold yet; may be called again after any end.

    Raises StoreError, InputError where a name stands for no file, SchedulerError; what was learnt
    until then stays in the store.
    """
    with Store(request.store, write=True) as store, closing(_make_pool(request, tell)) as pool:
        scan = Scan(request.rules, request.method, quick=request.quick, seconds=request.time_limit)
        return Coordinator(store, pool, request, tell).run(scan, request.sources)


def _make_pool(request: FleetRun, tell: Listener) -> Pool:
    if request.scheduler is not None:
        return DaskPool(request.scheduler, request.worker, tell)
    return LocalPool(request.workers or count_usable_cores(), request.worker)
