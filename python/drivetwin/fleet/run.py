# SPDX-License-Identifier: MIT
"""A fleet from files to a store: the one function behind `drivetwin fleet`."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

from drivetwin.estimation.result.method import DEFAULT_METHOD, Method
from drivetwin.fleet.coordinator import Coordinator, RunOptions
from drivetwin.fleet.events import Listener, Summary
from drivetwin.fleet.pool import LocalPool, Pool, count_usable_cores
from drivetwin.fleet.rules import RulesFile
from drivetwin.fleet.scan import Scan
from drivetwin.fleet.sources import Sources
from drivetwin.fleet.store import Store
from drivetwin.fleet.task import WorkerSpec


@dataclass(frozen=True)
class FleetRun:
    """Request of `drivetwin fleet`: files, rules, output folder and workers.

    `workers` processes run on this machine, one for each core if None. With `scheduler`, the
    address of a Dask scheduler, the work is done there instead.
    """

    sources: Sources
    rules: RulesFile
    store: Path
    method: Method = DEFAULT_METHOD
    workers: int | None = None
    scheduler: str | None = None
    worker: WorkerSpec = field(default_factory=WorkerSpec)
    wishes: RunOptions = field(default_factory=RunOptions)


def run_fleet(request: FleetRun, tell: Listener = lambda _: None) -> Summary:
    """Identify all logs that the store does not hold yet; may be called again after any end.

    Raises StoreError, InputError where a name stands for no file, SchedulerError; what was learnt
    until then stays in the store.
    """
    with Store(request.store, write=True) as store, closing(_make_pool(request, tell)) as pool:
        scan = Scan(request.rules, request.method, request.worker.limits.seconds)
        return Coordinator(store, pool, request.wishes, tell).run(scan, request.sources)


def _make_pool(request: FleetRun, tell: Listener) -> Pool:
    if request.scheduler is not None:
        from drivetwin.fleet.cluster import DaskPool

        return DaskPool(request.scheduler, request.worker, tell)
    return LocalPool(request.workers or count_usable_cores(), request.worker)
