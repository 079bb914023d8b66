# SPDX-License-Identifier: MIT
"""`python -m benchmarks.fleet.scaling [LOGS]`: what the fleet costs beside the identification.

Overhead per log, coordinator memory with 1,000 and 10,000 logs, two workers against one, a local
Dask cluster against processes. On a machine that others use, wall times say little: processor times
of all processes are told beside them.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

ROOT = Path(__file__).parents[2]
LOGS = 60
FEW, MANY = 1000, 10000


@dataclass(frozen=True)
class Cost:
    """Wall and processor time [s] of a run and of all its processes, memory of the coordinator."""

    wall: float
    processor: float
    memory: float

    def __str__(self) -> str:
        return f"{self.wall:.1f} s, processors {self.processor:.1f} s, {self.memory:.0f} MiB"


def _apart(*arguments: str) -> Cost:
    """This program in a process of its own with these arguments; what it printed last."""
    command = [sys.executable, "-m", "benchmarks.fleet.scaling", *arguments]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True
    )
    return Cost(**json.loads(done.stdout.splitlines()[-1]))


def _run(logs: Path, function: str, workers: int, cluster: bool) -> None:
    """Run a fleet in this process and print its cost, without the start of a cluster."""
    from contextlib import ExitStack

    from drivetwin.fleet.rules import RulesFile, RuleTable, read_rules
    from drivetwin.fleet.run import FleetRun, run_fleet
    from drivetwin.fleet.sources import Sources
    from drivetwin.fleet.task import WorkerSpec
    from drivetwin.identify.method import Method

    rules = (
        read_rules(logs / "rules.toml")
        if (logs / "rules.toml").is_file()
        else RulesFile(rules=[RuleTable(vehicle=str(logs / "card.toml"))])
    )
    with ExitStack() as stack:
        store = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "store"
        scheduler = None
        if cluster:
            distributed: Any = import_module("distributed")
            made = distributed.LocalCluster(
                n_workers=workers, threads_per_worker=1, dashboard_address=None, processes=True
            )
            scheduler = stack.enter_context(made).scheduler_address
        started = perf_counter()
        spec = WorkerSpec(function)
        request = FleetRun(
            Sources([str(logs)]), rules, store, Method.INTEGRAL, workers, scheduler, spec
        )
        summary = run_fleet(request)
        wall = perf_counter() - started
        assert summary.done + summary.bad == summary.files
    # Only now the processes of a cluster have ended and count.
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    processor = sum(one.ru_utime + one.ru_stime for one in used)
    print(json.dumps(vars(Cost(wall, processor, used[0].ru_maxrss / 1024))))


def _bare(logs: Path) -> None:
    """Identify the same logs one after the other in this process, without any fleet."""
    from drivetwin.errors import DrivetwinError
    from drivetwin.fleet.identify import identify_log
    from drivetwin.fleet.rules import read_rules
    from drivetwin.fleet.scan import Scan, Scanned
    from drivetwin.fleet.sources import Sources
    from drivetwin.fleet.task import Task
    from drivetwin.identify.method import Method

    scan = Scan(read_rules(logs / "rules.toml"), Method.INTEGRAL)
    wall, processor = 0.0, 0.0
    for one in scan.scanned(Sources([str(logs)]), lambda _: None):
        assert isinstance(one, Scanned)
        assert one.recipe is not None
        task = Task(one.file.log, one.file.path, one.file.content, one.recipe, "")
        before = perf_counter(), process_time()
        try:
            identify_log(task)
        except DrivetwinError:
            continue
        finally:
            wall += perf_counter() - before[0]
            processor += process_time() - before[1]
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps(vars(Cost(wall, processor, memory))))


IDENTIFY = "drivetwin.fleet.identify:identify_log"
TRIVIAL = "benchmarks.fleet.trivial:trivial"


def _memory(folder: Path) -> None:
    from benchmarks.fleet.trivial import make_small_files

    costs = {}
    for count in (FEW, MANY):
        logs = folder / f"small_{count}"
        make_small_files(logs, count)
        costs[count] = _apart("run", str(logs), TRIVIAL, "2", "")
        per_log = 1e3 * costs[count].processor / count
        print(f"{count} trivial logs, two workers: {costs[count]}; {per_log:.1f} ms of processor "
              "time each, starting included")  # fmt: skip
    growth = costs[MANY].memory / costs[FEW].memory - 1.0
    print(f"coordinator memory from {FEW} to {MANY} logs: {100 * growth:+.1f} %")


def _identification(folder: Path, count: int) -> None:
    from benchmarks.fleet.made import make_fleet

    logs, few = folder / "logs", folder / "few"
    make_fleet(logs, count)
    make_fleet(few, 2)
    bare = _apart("bare", str(logs))
    start = _apart("run", str(few), IDENTIFY, "1", "")
    one = _apart("run", str(logs), IDENTIFY, "1", "")
    two = _apart("run", str(logs), IDENTIFY, "2", "")
    dask = _apart("run", str(logs), IDENTIFY, "2", "cluster")
    each = bare.processor / count
    overhead = (one.processor - start.processor - (count - 2) * each) / (count - 2)
    print(f"{count} logs bare: {bare}")
    print(f"one worker: {one}; overhead {1e3 * overhead:.1f} ms of processor time per log")
    print(f"two workers: {two}; {one.wall / two.wall:.2f} times one by wall time, "
          f"{one.processor / two.processor:.2f} of the processor time")  # fmt: skip
    print(f"two workers in a Dask cluster: {dask}; {100 * (dask.wall / two.wall - 1):+.0f} % wall, "
          f"{100 * (dask.processor / two.processor - 1):+.0f} % processor")  # fmt: skip


def main() -> int:
    """Measure everything, or one run in this process."""
    match sys.argv[1:]:
        case ["run", logs, function, workers, cluster]:
            _run(Path(logs), function, int(workers), bool(cluster))
        case ["bare", logs]:
            _bare(Path(logs))
        case rest:
            print(f"load of the machine before: {os.getloadavg()[0]:.1f}")
            with tempfile.TemporaryDirectory() as temporary:
                _memory(Path(temporary))
                _identification(Path(temporary), int(rest[0]) if rest else LOGS)
    return 0


if __name__ == "__main__":
    sys.exit(main())
