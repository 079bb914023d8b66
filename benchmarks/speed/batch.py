# SPDX-License-Identifier: MIT
"""Many parameter sets on the stated shift, within 5 % of the nominal ones."""

from __future__ import annotations

import json
import subprocess
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from benchmarks.speed import c_peer, shift
from benchmarks.speed.core import BATCH, Examples
from benchmarks.speed.statement import BAR, SAMPLES, Inputs, Problem, start
from drivetwin.driveline import FloatArray

RUNS = 1000
LIMIT = 10.0
"""How many times as fast as the C program's batch on two threads."""
_SPREAD = 0.05
_VARIED = (0, 2, 3, 10, 11, 12, 13, 14, 17, 18, 19)
"""J_e, J_v, η, T_v, k, c, both gains, mu_s, mu_c, v_s in the order of the C program."""
_PARAMETERS = (
    *("J1", "J_v", "eta", "load.constant", "k_o", "c_o", "2.gain", "3.gain", "start.twist"),
    *(f"{clutch}.{field}" for clutch in ("2", "3") for field in ("mu_s", "mu_c", "v_s")),
)
_THREADS = (1, 2)
_ROUNDS, _REPEATS, _FINE_STEPS = 5, 3, 20


@dataclass
class Rates:
    """Runs per second of one program, pass by pass, by number of threads."""

    program: str
    seconds: dict[int, list[float]]

    def rate(self, threads: int) -> float:
        """Median runs per second."""
        return RUNS / float(np.median(self.seconds[threads]))


def sets(of: Problem) -> FloatArray:
    """Parameters (runs, 21) of a fixed seed, in the order of the C program."""
    noise = np.random.default_rng(1)
    numbers = np.tile(c_peer.parameters(of), (RUNS, 1))
    for column in _VARIED:
        numbers[:, column] *= 1.0 + _SPREAD * noise.standard_normal(RUNS)
    return numbers


def batches(of: Problem, given: Inputs, examples: Examples) -> str:
    """Runs per second and errors of each program, in turns."""
    numbers = sets(of)
    scenario = examples.store_text("batch", _scenario(of, given))
    values = examples.store_text("sets", _sets(of, given, numbers))
    ours = Rates(shift.PROGRAM, {threads: [] for threads in _THREADS})
    theirs = Rates(c_peer.PROGRAM, {threads: [] for threads in _THREADS})
    library = _library(examples)
    torques = np.zeros((0, SAMPLES))
    for _ in range(_ROUNDS):
        for threads in _THREADS:
            arguments = (str(scenario), str(values), str(threads), str(_REPEATS))
            found = examples.call(BATCH, *arguments)
            ours.seconds[threads] += [1e-9 * ns for ns in found["ns"]]
            torques = np.array(found["torque"], dtype=np.float64).reshape(RUNS, SAMPLES)
            if library is not None:
                begin = time.perf_counter()
                library.batch(numbers, of, given, (threads, 1))
                theirs.seconds[threads].append(time.perf_counter() - begin)
    if library is None:
        return _table([ours], None)
    exact = library.batch(numbers, of, given, (max(_THREADS), _FINE_STEPS))
    rough = library.batch(numbers, of, given, (max(_THREADS), 1))
    errors = [_errors(ours.program, torques, exact), _errors(theirs.program, rough, exact)]
    return _table([theirs, ours], theirs) + "\n" + "\n".join([*_ERROR_HEAD, *errors]) + "\n"


_ERROR_HEAD = (
    f"Errors of T_o over {RUNS} runs [N·m], against C at {_FINE_STEPS} steps per sample:\n",
    "| program | median | 99 % | worst | failed |",
    "|---|---|---|---|---|",
)


def _library(examples: Examples) -> c_peer.Library | None:
    if not c_peer.SOURCE.exists():
        return None
    try:
        return c_peer.Library(examples.folder)
    except (subprocess.CalledProcessError, FileNotFoundError):
        return None


def _scenario(of: Problem, given: Inputs) -> str:
    begin = asdict(shift.state_of(of, given))
    signals = {name: one.values.tolist() for name, one in shift.signals_of(given).items()}
    return json.dumps(
        {
            "model": asdict(shift.model_of(of)),
            "time": given.time.tolist(),
            "signals": signals,
            "start": begin,
        }
    )


def _sets(of: Problem, given: Inputs, numbers: FloatArray) -> str:
    """The same sets under drivetwin's names; the C program starts all with one spring torque."""
    spring = start(of, given)[3]
    rows = []
    for p in numbers:
        gains = p[13:15] / BAR
        law = [float(p[17]), float(p[18]), float(p[19])]
        rows.append(
            [
                *(float(p[0] / p[3]), float(p[2]), float(p[3]), float(p[10])),
                *(float(p[11]), float(p[12]), *gains.tolist(), spring / float(p[11])),
                *(law + law),
            ]
        )
    return json.dumps({"parameters": _PARAMETERS, "values": rows})


def _table(rates: Sequence[Rates], base: Rates | None) -> str:
    lines = ["| program | threads | runs per second | times C |", "|---|---|---|---|"]
    for one in rates:
        for threads in _THREADS:
            times = "" if base is None else f"{one.rate(threads) / base.rate(threads):.3g}"
            lines.append(f"| {one.program} | {threads} | {one.rate(threads):,.0f} | {times} |")
    return "\n".join(lines) + "\n"


def _errors(program: str, torques: FloatArray, exact: FloatArray) -> str:
    worst = np.abs(torques - exact).max(axis=1)
    known = worst[np.isfinite(worst)]
    levels = (np.median(known), np.quantile(known, 0.99), known.max())
    shown = " | ".join(f"{level:.2g}" for level in levels)
    return f"| {program} | {shown} | {worst.size - known.size} |"
