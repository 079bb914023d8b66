# SPDX-License-Identifier: MIT
"""A fleet from files to a store: the one function behind `drivetwin fleet`."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

from drivetwin.fleet.coordinator import Coordinator
from drivetwin.fleet.events import Listener, Summary
from drivetwin.fleet.options import FleetOptions
from drivetwin.fleet.pool import LocalPool, Pool, count_usable_cores
from drivetwin.fleet.rules import RulesFile
from drivetwin.fleet.scan import Scan
from drivetwin.fleet.sources import Sources
from drivetwin.fleet.store import Store
from drivetwin.fleet.task import IDENTIFY, Limits, WorkerSpec


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
        scan = Scan(request.rules, request.method, request.time_limit)
        return Coordinator(store, pool, request, tell).run(scan, request.sources)


def _make_pool(request: FleetRun, tell: Listener) -> Pool:
    if request.scheduler is not None:
        from drivetwin.fleet.cluster import DaskPool

        return DaskPool(request.scheduler, request.worker, tell)
    return LocalPool(request.workers or count_usable_cores(), request.worker)
