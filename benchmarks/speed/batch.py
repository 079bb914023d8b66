# SPDX-License-Identifier: MIT
"""Many parameter sets on the stated shift, within 5 % of the nominal ones.

`python -m benchmarks.speed.batch KEEP RUNS` prints the largest memory [byte] of one batch.
"""

from __future__ import annotations

import re
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.speed import c_peer, shift
from drivetwin.simulation.batch import Batch, Keep
from drivetwin.simulation.driveline import SHAFT
from drivetwin.simulation.dual_clutch import FloatArray
from drivetwin.simulation.network_response import NetworkScenario, simulate_network_batch
from tests.support.upshift.scenario import build_scenario
from tests.support.upshift.statement import BAR, Inputs, Problem, make_inputs, make_problem, start

RUNS = 1000
_SPREAD = 0.05
_VARIED = (0, 2, 3, 10, 11, 12, 13, 14, 17, 18, 19)
"""J_e, J_v, η, T_v, k, c, both gains, mu_s, mu_c, v_s in the order of the C program."""
_THREADS = (1, 2)
_LIMIT = 10.0
"""Runs per second over those of C, on the most threads."""
_ROUNDS, _FINE_STEPS = 15, 20
_MEMORY_RUNS = (2000, 10_000)
_KEPT: dict[Keep, str] = {
    Keep.COLUMNS: "T_o at every sample",
    Keep.LAST: "T_o at the end; a misfit takes as much",
}


@dataclass
class Rates:
    """Times of the passes of one program over all sets [s], by number of threads."""

    program: str
    seconds: dict[int, list[float]]

    def rate(self, threads: int) -> float:
        """Median runs per second."""
        return RUNS / float(np.median(self.seconds[threads]))


def draw_sets(of: Problem, runs: int = RUNS) -> FloatArray:
    """Return parameters (runs, 21) of a fixed seed, in the order of the C program."""
    noise = np.random.default_rng(1)
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


def measure_batches(of: Problem, given: Inputs, folder: Path) -> str:
    """Measure runs per second, errors and memory, the programs in turns."""
    sets, library = draw_sets(of), c_peer.load_library(folder)
    ours = Rates(shift.PROGRAM, {threads: [] for threads in _THREADS})
    theirs = Rates(c_peer.PROGRAM, {threads: [] for threads in _THREADS})
    # Once beforehand: the first calls of a process wait for its memory.
    found = simulate_sets(of, given, sets, (Keep.COLUMNS, max(_THREADS)))
    for _ in range(_ROUNDS):
        for threads in _THREADS:
            begin = time.perf_counter()
            found = simulate_sets(of, given, sets, (Keep.COLUMNS, threads))
            ours.seconds[threads].append(time.perf_counter() - begin)
            if library is not None:
                begin = time.perf_counter()
                rough = library.run_batch(sets, of, given, (threads, 1))
                theirs.seconds[threads].append(time.perf_counter() - begin)
    if library is None:
        return "\n".join([_format_table([ours], None), _measure_memory()])
    exact = library.run_batch(sets, of, given, (max(_THREADS), _FINE_STEPS))
    lines = [
        f"Errors of T_o over {RUNS} runs [N·m], against C at {_FINE_STEPS} steps per sample:\n",
        "| program | median | 99 % | worst | failed |",
        "|---|---|---|---|---|",
        _format_errors(theirs.program, rough, exact),
        _format_errors(ours.program, found.values[:, 0], exact),
        "",
    ]
    return "\n".join([_format_table([theirs, ours], theirs), *lines, _measure_memory()])


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


def _format_table(rates: Sequence[Rates], base: Rates | None) -> str:
    lines = [
        "| program | threads | runs per second | times C | of the shortest passes |",
        "|---|---|---|---|---|",
    ]
    for one in rates:
        for threads in _THREADS:
            rate = one.rate(threads)
            times = ["", ""] if base is None else _format_ratios(one, base, threads)
            lines.append(f"| {one.program} | {threads} | {rate:,.0f} | {' | '.join(times)} |")
    lines.append(f"\nSet out to be reached: {_LIMIT:g} times C on {max(_THREADS)} threads.")
    return "\n".join(lines) + "\n"


def _format_ratios(one: Rates, base: Rates, threads: int) -> list[str]:
    """Return the rates over those of another program, by medians and by the shortest passes."""
    medians = one.rate(threads) / base.rate(threads)
    shortest = min(base.seconds[threads]) / min(one.seconds[threads])
    return [f"{medians:.3g}", f"{shortest:.3g}"]


def _format_errors(program: str, torques: FloatArray, exact: FloatArray) -> str:
    worst = np.abs(torques - exact).max(axis=1)
    known = worst[np.isfinite(worst)]
    levels = (np.median(known), np.quantile(known, 0.99), known.max())
    shown = " | ".join(f"{level:.2g}" for level in levels)
    return f"| {program} | {shown} | {worst.size - known.size} |"


def _measure_memory() -> str:
    """Measure bytes per run, from the largest memory of processes with few and with many runs."""
    if not Path("/proc/self/status").exists():
        return "Memory is measured on Linux only.\n"
    lines = ["Memory of a batch, per run:\n", "| kept | bytes per run |", "|---|---|"]
    for keep, what in _KEPT.items():
        few, many = _measure_peak(keep, _MEMORY_RUNS[0]), _measure_peak(keep, _MEMORY_RUNS[1])
        per_run = (many - few) / (_MEMORY_RUNS[1] - _MEMORY_RUNS[0])
        lines.append(f"| {what} | {per_run:,.0f} |")
    return "\n".join(lines) + "\n"


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
