# SPDX-License-Identifier: MIT
"""Many parameter sets on the stated shift, within 5 % of the nominal ones.

`python -m benchmarks.speed.batch KEEP RUNS` prints the largest memory [byte] of one batch.
"""

from __future__ import annotations

import re
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.speed import c_peer, shift
from drivetwin.simulation.driveline import SHAFT
from drivetwin.simulation.dual_clutch import FloatArray
from drivetwin.simulation.network import Batch, Keep
from drivetwin.simulation.network_response import NetworkScenario, simulate_network_batch
from tests.support.upshift.scenario import build_scenario
from tests.support.upshift.statement import BAR, Inputs, Problem, make_inputs, make_problem, start

RUNS, SEED = 1000, 1
_SPREAD = 0.05
_VARIED = (0, 2, 3, 10, 11, 12, 13, 14, 17, 18, 19)
"""J_e, J_v, η, T_v, k, c, both gains, mu_s, mu_c, v_s in the order of the C program."""
_THREADS = (1, 2)
_ROUNDS, FINE_STEPS = 15, 20
_MEMORY_RUNS = (2000, 10_000)
_KEPT: dict[Keep, str] = {
    Keep.COLUMNS: "T_o at every sample",
    Keep.LAST: "T_o at the end; a misfit takes as much",
}


def draw_sets(of: Problem, runs: int = RUNS) -> FloatArray:
    """Return parameters (runs, 21) of a fixed seed, in the order of the C program."""
    noise = np.random.default_rng(SEED)
    numbers = np.tile(c_peer.list_parameters(of), (runs, 1))
    for column in _VARIED:
        numbers[:, column] *= 1.0 + _SPREAD * noise.standard_normal(runs)
    return numbers


def simulate_sets(of: Problem, given: Inputs, sets: FloatArray, how: tuple[Keep, int]) -> Batch:
    """Simulate all sets in drivetwin; `how` is what is kept and the number of threads."""
    keep, threads = how
    nominal = build_scenario(of, given)
    return simulate_network_batch(
        nominal.elements,
        [NetworkScenario(nominal.inputs, nominal.start)],
        given.time,
        [("shaft_torque", SHAFT)],
        _name_columns(of, given, sets),
        keep=keep,
        threads=threads,
    )


def measure_batches(of: Problem, given: Inputs, folder: Path) -> dict[str, Any]:
    """Measure seconds of whole batches, errors and memory, the programs in turns.

    One thread is measured by CPU time; several are by the clock on the wall.
    """
    sets, library = draw_sets(of), c_peer.load_library(folder)
    programs: dict[str, Callable[[int], FloatArray]] = {
        shift.PROGRAM: lambda threads: simulate_sets(
            of, given, sets, (Keep.COLUMNS, threads)
        ).values[:, 0]
    }
    if library is not None:
        programs[c_peer.PROGRAM] = lambda threads: library.run_batch(sets, of, given, (threads, 1))
    # Once beforehand: the first calls of a process wait for its memory.
    torques = {name: run(max(_THREADS)) for name, run in programs.items()}
    seconds: dict[str, dict[str, list[float]]] = {
        name: {str(threads): [] for threads in _THREADS} for name in programs
    }
    for _ in range(_ROUNDS):
        for threads in _THREADS:
            clock = time.process_time if threads == 1 else time.perf_counter
            for name, run in programs.items():
                begin = clock()
                run(threads)
                seconds[name][str(threads)].append(clock() - begin)
    found: dict[str, Any] = {"runs": RUNS, "seconds": seconds, "memory": _measure_memory()}
    if library is not None:
        exact = library.run_batch(sets, of, given, (max(_THREADS), FINE_STEPS))
        found["fine_steps"] = FINE_STEPS
        found["errors"] = {name: _rate_errors(one, exact) for name, one in torques.items()}
    return found


def _name_columns(of: Problem, given: Inputs, sets: FloatArray) -> dict[str, FloatArray]:
    """Map paths of numbers to columns; all sets start with the same torque of the shaft."""
    column = dict(enumerate(sets.T))
    laws = {
        f"{clutch}.friction.{field}": column[place]
        for clutch in ("2", "3")
        for field, place in (("mu_s", 17), ("mu_c", 18), ("v_s", 19))
    }
    return {
        "J1.inertia": column[0] / column[3],
        "J_v.inertia": column[2],
        "i_in.loss.eta": column[3],
        "load.constant": column[10],
        f"{SHAFT}.stiffness": column[11],
        f"{SHAFT}.damping": column[12],
        "2.gain": column[13] / BAR,
        "3.gain": column[14] / BAR,
        f"start.{SHAFT}": start(of, given)[3] / column[11],
        **laws,
    }


def _rate_errors(torques: FloatArray, exact: FloatArray) -> dict[str, float]:
    """Return quantiles of the largest errors of the runs [N m], and how many failed."""
    worst = np.abs(torques - exact).max(axis=1)
    known = worst[np.isfinite(worst)]
    median, most = (float(np.quantile(known, share)) for share in (0.5, 0.99))
    failed = worst.size - known.size
    return {"median": median, "99 %": most, "worst": float(known.max()), "failed": failed}


def _measure_memory() -> dict[str, float]:
    """Measure bytes per run, from the largest memory of processes with few and with many runs."""
    if not Path("/proc/self/status").exists():
        return {}
    found = {}
    for keep, name in _KEPT.items():
        few, many = _measure_peak(keep, _MEMORY_RUNS[0]), _measure_peak(keep, _MEMORY_RUNS[1])
        found[name] = (many - few) / (_MEMORY_RUNS[1] - _MEMORY_RUNS[0])
    return found


def _measure_peak(keep: Keep, runs: int) -> int:
    command = [sys.executable, "-m", "benchmarks.speed.batch", keep.value, str(runs)]
    return int(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def main() -> None:
    """Run one batch and print the largest memory of this process [byte]."""
    of = make_problem()
    keep, runs = Keep(sys.argv[1]), int(sys.argv[2])
    simulate_sets(of, make_inputs(), draw_sets(of, runs), (keep, 2))
    # The largest memory in the resource usage of a child includes that of its parent.
    (kilobytes,) = re.findall(r"VmHWM:\s*(\d+) kB", Path("/proc/self/status").read_text("utf-8"))
    print(1024 * int(kilobytes))


if __name__ == "__main__":
    main()
