# SPDX-License-Identifier: MIT
"""Cost of a fleet besides the identification: `python -m benchmarks.fleet.scaling [LOGS]`.

Printed are the coordinator's memory with 1,000 and 10,000 logs that leave as many rows as a real
log; then, of logs that are identified, the overhead per log, two workers against one, and a local
Dask cluster against processes. Times of the second group count from the 21st log to the last, so
that starting processes, importing and connecting do not matter. On a machine that others use wall
times say little; processor times of all processes stand beside them.

`benchmarks/fleet/stand_in.py` is imported where it is used: with identification itself a
coordinator would hold more than `drivetwin fleet` does.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from time import perf_counter
from typing import Any

from drivetwin.fleet.coordinator import FleetRun, run_fleet
from drivetwin.fleet.pool import ONE_THREAD
from drivetwin.fleet.rules import Sources, read_rules
from drivetwin.fleet.store import Store
from drivetwin.fleet.task import Event, RowKind, Settled, Started, State

ROOT = Path(__file__).parents[2]
LOGS, FIRST = 60, 20
"""Logs behind a figure, and those before them."""
FEW, MANY = 1000, 10000
IDENTIFY = "benchmarks.fleet.stand_in:identify_timed"
REAL_ROWS = "benchmarks.fleet.stand_in:copy_rows"


@dataclass(frozen=True)
class Cost:
    """Wall time, and processor time of all processes [s], of a number of logs."""

    logs: int
    wall: float
    processor: float

    def subtract(self, first: Cost) -> Cost:
        """Return the cost after an earlier moment of the run."""
        times = self.wall - first.wall, self.processor - first.processor
        return Cost(self.logs - first.logs, *times)

    def __str__(self) -> str:
        each = 1e3 * self.processor / self.logs
        return f"{self.logs} logs in {self.wall:.1f} s, {each:.1f} ms of processor time each"


@dataclass(frozen=True)
class Ran:
    """Result of a run: cost of the logs after the first ones, the processor time [s] of each of
    these within identification, and the largest memory of the coordinator [MiB].
    """

    steady: Cost
    identifying: float
    memory: float


def _run_apart(logs: Path, function: str, workers: int, *, cluster: bool = False) -> Ran:
    """Run a fleet in a process of its own."""
    arguments = (str(logs), function, str(workers), "cluster" if cluster else "")
    command = [sys.executable, "-m", "benchmarks.fleet.scaling", "run", *arguments]
    environment = {**os.environ, **ONE_THREAD, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, check=True)
    tree = json.loads(done.stdout.splitlines()[-1])
    return Ran(**{**tree, "steady": Cost(**tree["steady"])})


class _Watch:
    """Listener of a run; `costs` are those at the first logs and at the last one."""

    def __init__(self) -> None:
        self.costs: list[Cost] = []
        self.settled: list[str] = []
        self._files = 0
        self._start = perf_counter()

    def hear(self, event: Event) -> None:
        """Handle an event of the run."""
        if isinstance(event, Started):
            self._files = event.files
        elif isinstance(event, Settled):
            assert event.state is State.DONE, event
            self.settled.append(event.log)
            if len(self.settled) in (FIRST, self._files):
                wall = perf_counter() - self._start
                self.costs.append(Cost(len(self.settled), wall, _measure_processor()))


def _run(logs: Path, function: str, workers: int, cluster: bool) -> Ran:
    """Run a fleet in this process."""
    with ExitStack() as stack:
        store = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "store"
        scheduler = (
            stack.enter_context(_start_cluster(workers)).scheduler_address if cluster else None
        )
        request = FleetRun(
            sources=Sources([str(logs)]),
            rules=read_rules(logs / "rules.toml"),
            store=store,
            quick=True,
            workers=workers,
            scheduler=scheduler,
            function=function,
        )
        watch = _Watch()
        run_fleet(request, watch.hear)
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        identifying = _read_clock(store, watch.settled[FIRST:])
    first, last = watch.costs
    return Ran(last.subtract(first), identifying, memory)


def _read_clock(store: Path, logs: Sequence[str]) -> float:
    """Return the mean processor time [s] of identifying these logs, from the rows that state it."""
    from benchmarks.fleet.stand_in import CLOCK

    with Store(store) as opened:
        rows = opened.read_rows(RowKind.QUALITY).to_pylist()
    clock = {row["log"]: float(row["value"]) for row in rows if row["name"] == CLOCK}
    return sum(clock.get(log, 0.0) for log in logs) / len(logs)


def _start_cluster(workers: int) -> Any:
    """Start a Dask cluster on this machine as docs/howto/fleet.md advises, else with defaults."""
    distributed = import_module("distributed")
    return distributed.LocalCluster(
        n_workers=1, threads_per_worker=workers, dashboard_address=None, processes=True
    )


def _measure_processor() -> float:
    """Return the processor time [s] of this process and of its children that still run."""
    this = import_module("psutil").Process()
    times = [one.cpu_times() for one in (this, *this.children(recursive=True))]
    return float(sum(one.user + one.system for one in times))


def _measure_memory(folder: Path) -> None:
    from benchmarks.fleet.stand_in import make_small_files

    memory = []
    for count in (FEW, MANY):
        logs = folder / f"small_{count}"
        make_small_files(logs, count)
        memory.append(_run_apart(logs, REAL_ROWS, 2).memory)
        print(f"{count} logs without identification: coordinator at most {memory[-1]:.0f} MiB")
    print(f"growth of the coordinator's memory: {100 * (memory[1] / memory[0] - 1):+.1f} %")


def _measure_identification(folder: Path, count: int) -> None:
    from benchmarks.fleet.stand_in import make_healthy_logs

    logs = folder / "logs"
    make_healthy_logs(logs, count + FIRST)
    found = [_run_apart(logs, IDENTIFY, 1), _run_apart(logs, IDENTIFY, 2)]
    found.append(_run_apart(logs, IDENTIFY, 2, cluster=True))
    one, two, dask = (each.steady for each in found)
    inside = found[0].identifying
    print(f"one worker: {one}, of which {1e3 * inside:.1f} ms are identification; overhead "
          f"{1e3 * (one.processor / one.logs - inside):.1f} ms")  # fmt: skip
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
                _measure_memory(Path(temporary))
                _measure_identification(Path(temporary), int(rest[0]) if rest else LOGS)
    return 0


if __name__ == "__main__":
    sys.exit(main())
