# SPDX-License-Identifier: MIT
"""`python -m benchmarks.fleet.scaling [LOGS]`: what the fleet costs beside the identification.

Every figure is the difference of a run over many logs and one over few, so that starting processes,
importing, connecting and the first use of everything count on neither side. Told are: coordinator
memory with 1,000 and 10,000 logs that leave what a real log leaves, overhead per log, two workers
against one, a local Dask cluster against processes. On a machine that others use wall times say
little; processor times of all processes stand beside them.

`benchmarks/fleet/stand_in.py` is imported where it is used: with identification itself a
coordinator would hold more than `drivetwin fleet` does.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from importlib import import_module
from pathlib import Path
from time import perf_counter
from typing import Any

from drivetwin.fleet.events import Event, Summary
from drivetwin.fleet.rows import RowKind
from drivetwin.fleet.rules import read_rules
from drivetwin.fleet.run import FleetRun, run_fleet
from drivetwin.fleet.scan import Scan, Scanned
from drivetwin.fleet.sources import Sources
from drivetwin.fleet.store import Store
from drivetwin.fleet.task import Task, WorkerSpec
from drivetwin.identify.method import Method

ROOT = Path(__file__).parents[2]
LOGS, FIRST = 60, 20
"""Logs behind a figure, and those before them."""
FEW, MANY = 1000, 10000
IDENTIFY = "benchmarks.fleet.stand_in:timed"
REAL_ROWS = "benchmarks.fleet.stand_in:real_rows"


@dataclass(frozen=True)
class Cost:
    """Of a run over `logs`: wall time, processor time of all processes, that within identification
    [s]; most memory of the coordinator [MiB].
    """

    logs: int
    wall: float
    processor: float
    identifying: float
    memory: float

    def beyond(self, first: Cost) -> Cost:
        """What the logs cost that this run has beyond another."""
        return replace(
            self,
            logs=self.logs - first.logs,
            wall=self.wall - first.wall,
            processor=self.processor - first.processor,
            identifying=self.identifying - first.identifying,
        )

    def each(self, seconds: float) -> float:
        """Milliseconds for each log."""
        return 1e3 * seconds / self.logs

    def __str__(self) -> str:
        return (
            f"{self.logs} logs in {self.wall:.1f} s, {self.each(self.processor):.1f} ms of "
            f"processor time each; coordinator at most {self.memory:.0f} MiB"
        )


def _apart(logs: Path, function: str, workers: int, *, cluster: bool = False) -> Cost:
    """A run in a process of its own."""
    arguments = ["run", str(logs), function, str(workers), "cluster" if cluster else ""]
    command = [sys.executable, "-m", "benchmarks.fleet.scaling", *arguments]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, check=True)
    return Cost(**json.loads(done.stdout.splitlines()[-1]))


def _run(logs: Path, function: str, workers: int, cluster: bool) -> Cost:
    """Run a fleet in this process."""
    costs: list[Cost] = []
    with ExitStack() as stack:
        store = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "store"
        scheduler = stack.enter_context(_cluster(workers)).scheduler_address if cluster else None
        start = perf_counter()

        def hear(event: Event) -> None:
            if isinstance(event, Summary):  # the workers are still there
                assert event.done == event.files
                wall = perf_counter() - start
                costs.append(Cost(event.done, wall, _processor(), 0.0, _most_memory()))

        request = FleetRun(
            Sources([str(logs)]), read_rules(logs / "rules.toml"), store, Method.INTEGRAL,
            workers, scheduler, WorkerSpec(function),
        )  # fmt: skip
        run_fleet(request, hear)
        return replace(costs[0], identifying=_identifying(store))


def _identifying(store: Path) -> float:
    """Processor time [s] that all logs of a store took to identify, as they say."""
    from benchmarks.fleet.stand_in import CLOCK

    with Store(store) as opened:
        rows = opened.rows(RowKind.QUALITY).to_pylist()
    return float(sum(row["value"] for row in rows if row["name"] == CLOCK))


def _cluster(workers: int) -> Any:
    """A Dask cluster on this machine, as docs/howto/fleet.md advises: one worker of many threads.

    All else is as Dask has it.
    """
    distributed = import_module("distributed")
    return distributed.LocalCluster(
        n_workers=1, threads_per_worker=workers, dashboard_address=None, processes=True
    )


def _processor() -> float:
    """Processor time [s] of this process and of all that it started and that still run."""
    this = import_module("psutil").Process()
    times = [one.cpu_times() for one in (this, *this.children(recursive=True))]
    return float(sum(one.user + one.system for one in times))


def _most_memory() -> float:
    """The most memory that this process ever held [MiB]."""
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _bare(logs: Path) -> float:
    """Processor time [s] for each log in this process, without any fleet, after the first ones."""
    from benchmarks.fleet.stand_in import timed

    seconds = []
    scan = Scan(read_rules(logs / "rules.toml"), Method.INTEGRAL)
    for one in scan.scanned(Sources([str(logs)]), lambda _: None):
        assert isinstance(one, Scanned)
        assert one.recipe is not None
        found = timed(Task(one.file.log, one.file.path, one.file.content, one.recipe, ""))
        seconds.append(found.rows[-1].value or 0.0)
    return sum(seconds[FIRST:]) / len(seconds[FIRST:])


def _memory(folder: Path) -> None:
    from benchmarks.fleet.stand_in import make_small_files

    costs = []
    for count in (FEW, MANY):
        logs = folder / f"small_{count}"
        make_small_files(logs, count)
        costs.append(_apart(logs, REAL_ROWS, 2))
        print(f"without identification: {costs[-1]}")
    few, many = costs
    beyond = many.beyond(few)
    growth = 100 * (many.memory / few.memory - 1)
    print(f"coordinator memory from {FEW} to {MANY} logs: {growth:+.1f} %")
    print(f"the fleet's own work: {beyond.each(beyond.processor):.1f} ms of processor time a log")


def _identification(folder: Path, count: int) -> None:
    from benchmarks.fleet.stand_in import make_healthy_logs

    few, logs = folder / "few", folder / "logs"
    make_healthy_logs(few, FIRST)
    make_healthy_logs(logs, count + FIRST)

    def beyond(workers: int, *, cluster: bool = False) -> Cost:
        first = _apart(few, IDENTIFY, workers, cluster=cluster)
        return _apart(logs, IDENTIFY, workers, cluster=cluster).beyond(first)

    one, bare, two, dask = beyond(1), _bare(logs), beyond(2), beyond(2, cluster=True)
    own = one.each(one.processor - one.identifying)
    print(f"one worker: {one}")
    print(f"of this, {one.each(one.identifying):.1f} ms are identification, {1e3 * bare:.1f} ms "
          f"without a fleet; overhead {own:.1f} ms a log")  # fmt: skip
    print(f"two workers: {two}; {one.wall / two.wall:.2f} times one by wall time, "
          f"{one.processor / two.processor:.2f} by processor time")  # fmt: skip
    print(f"two in a Dask cluster: {dask}; {100 * (dask.wall / two.wall - 1):+.0f} % wall time, "
          f"{100 * (dask.processor / two.processor - 1):+.0f} % processor time")  # fmt: skip


def main() -> int:
    """Measure everything, or one run in this process."""
    match sys.argv[1:]:
        case ["run", logs, function, workers, cluster]:
            print(json.dumps(asdict(_run(Path(logs), function, int(workers), bool(cluster)))))
        case rest:
            print(f"load of the machine before: {os.getloadavg()[0]:.1f}")
            with tempfile.TemporaryDirectory() as temporary:
                _memory(Path(temporary))
                _identification(Path(temporary), int(rest[0]) if rest else LOGS)
    return 0


if __name__ == "__main__":
    sys.exit(main())
