# SPDX-License-Identifier: MIT
"""`python -m benchmarks.fleet.scaling [LOGS]`: what the fleet costs beside the identification.

Told are: what the fleet does itself for each log, and the coordinator's memory, with 1,000 and
10,000 logs that leave what a real log leaves; then, of logs that are identified, the overhead per
log, two workers against one, a local Dask cluster against processes. The second group is counted
from the 21st log to the last, so that starting processes, importing, connecting and the first use
of everything count on neither side. On a machine that others use wall times say little; processor
times of all processes stand beside them.

`benchmarks/fleet/stand_in.py` is imported where it is used: with identification itself a
coordinator would hold more than `drivetwin fleet` does.
"""

from __future__ import annotations

import json
import os
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

from drivetwin.fleet.cell import ONE_THREAD
from drivetwin.fleet.events import Event, Settled, Started, Summary
from drivetwin.fleet.rows import RowKind
from drivetwin.fleet.rules import read_rules
from drivetwin.fleet.run import FleetRun, run_fleet
from drivetwin.fleet.scan import Scan, Scanned
from drivetwin.fleet.sources import Sources
from drivetwin.fleet.store import Store
from drivetwin.fleet.task import State, Task, WorkerSpec
from drivetwin.identify.method import Method

ROOT = Path(__file__).parents[2]
LOGS, FIRST = 60, 20
"""Logs behind a figure, and those before them."""
FEW, MANY = 1000, 10000
IDENTIFY = "benchmarks.fleet.stand_in:timed"
REAL_ROWS = "benchmarks.fleet.stand_in:real_rows"


@dataclass(frozen=True)
class Cost:
    """Of so many logs: wall time, and processor time of all processes [s]."""

    logs: int
    wall: float
    processor: float

    def since(self, first: Cost) -> Cost:
        """What came after an earlier moment of the run, or of a shorter one."""
        times = self.wall - first.wall, self.processor - first.processor
        return Cost(self.logs - first.logs, *times)

    def __str__(self) -> str:
        each = 1e3 * self.processor / self.logs
        return f"{self.logs} logs in {self.wall:.1f} s, {each:.1f} ms of processor time each"


@dataclass(frozen=True)
class Ran:
    """A run: its cost to the end, that of the logs after the first ones, the processor time [s]
    for each of these within identification, and the most memory of the coordinator [MiB].
    """

    whole: Cost
    steady: Cost
    identifying: float
    memory: float


def _apart(*arguments: str) -> Any:
    """This program with these arguments in a process of its own; what it printed last."""
    command = [sys.executable, "-m", "benchmarks.fleet.scaling", *arguments]
    environment = {**os.environ, **ONE_THREAD, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def _ran(logs: Path, function: str, workers: int, *, cluster: bool = False) -> Ran:
    """A run in a process of its own."""
    tree = _apart("run", str(logs), function, str(workers), "cluster" if cluster else "")
    return Ran(**{**tree, "whole": Cost(**tree["whole"]), "steady": Cost(**tree["steady"])})


class _Watch:
    """Listens to a run; `costs` are those at the first logs, at the last one, and at the end."""

    def __init__(self) -> None:
        self.costs: list[Cost] = []
        self.settled: list[str] = []
        self._files = 0
        self._start = perf_counter()

    def hear(self, event: Event) -> None:
        """Take in what the run tells."""
        if isinstance(event, Started):
            self._files = event.files
        elif isinstance(event, Settled):
            assert event.state is State.DONE, event
            self.settled.append(event.log)
            if len(self.settled) in (FIRST, self._files):
                self._look()
        elif isinstance(event, Summary):  # the workers are still there
            self._look()

    def _look(self) -> None:
        wall = perf_counter() - self._start
        self.costs.append(Cost(len(self.settled), wall, _processor()))


def _run(logs: Path, function: str, workers: int, cluster: bool) -> Ran:
    """Run a fleet in this process."""
    with ExitStack() as stack:
        store = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "store"
        scheduler = stack.enter_context(_cluster(workers)).scheduler_address if cluster else None
        request = FleetRun(
            Sources([str(logs)]), read_rules(logs / "rules.toml"), store, Method.INTEGRAL,
            workers, scheduler, WorkerSpec(function),
        )  # fmt: skip
        watch = _Watch()
        run_fleet(request, watch.hear)
        memory = _most_memory()
        identifying = _identifying(store, watch.settled[FIRST:])
    first, last, end = watch.costs
    return Ran(end, last.since(first), identifying, memory)


def _identifying(store: Path, logs: Sequence[str]) -> float:
    """Processor time [s] that identifying these logs took, each on average, as they say."""
    from benchmarks.fleet.stand_in import CLOCK

    with Store(store) as opened:
        rows = opened.rows(RowKind.QUALITY).to_pylist()
    clock = {row["log"]: float(row["value"]) for row in rows if row["name"] == CLOCK}
    return sum(clock.get(log, 0.0) for log in logs) / len(logs)


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

    found = []
    for count in (FEW, MANY):
        logs = folder / f"small_{count}"
        make_small_files(logs, count)
        found.append(_ran(logs, REAL_ROWS, 2))
        print(f"without identification: {found[-1].whole}, coordinator at most "
              f"{found[-1].memory:.0f} MiB")  # fmt: skip
    few, many = found
    more = many.whole.since(few.whole)
    growth = 100 * (many.memory / few.memory - 1)
    print(
        f"the fleet's own work: {1e3 * more.processor / more.logs:.1f} ms of processor time a log"
    )
    print(f"coordinator memory from {FEW} to {MANY} logs: {growth:+.1f} %")


def _identification(folder: Path, count: int) -> None:
    from benchmarks.fleet.stand_in import make_healthy_logs

    logs = folder / "logs"
    make_healthy_logs(logs, count + FIRST)
    bare: float = _apart("bare", str(logs))
    found = [_ran(logs, IDENTIFY, 1), _ran(logs, IDENTIFY, 2)]
    found.append(_ran(logs, IDENTIFY, 2, cluster=True))
    one, two, dask = (each.steady for each in found)
    inside = found[0].identifying
    print(f"one worker: {one}, of which {1e3 * inside:.1f} ms are identification "
          f"({1e3 * bare:.1f} ms without a fleet); overhead "
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
        case ["bare", logs]:
            print(json.dumps(_bare(Path(logs))))
        case rest:
            print(f"load of the machine before: {os.getloadavg()[0]:.1f}")
            with tempfile.TemporaryDirectory() as temporary:
                _memory(Path(temporary))
                _identification(Path(temporary), int(rest[0]) if rest else LOGS)
    return 0


if __name__ == "__main__":
    sys.exit(main())
