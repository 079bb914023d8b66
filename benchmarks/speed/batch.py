# SPDX-License-Identifier: MIT
"""Many parameter sets on the stated shift, within 5 % of the nominal ones."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path

import numpy as np

from benchmarks.speed import c_peer
from benchmarks.speed.statement import Inputs, Problem
from drivetwin.driveline import FloatArray

RUNS = 1000
_SPREAD = 0.05
_VARIED = (0, 2, 3, 10, 11, 12, 13, 14, 17, 18, 19)
"""J_e, J_v, η, T_v, k, c, both gains, mu_s, mu_c, v_s in the order of the C program."""
_ROUNDS = 5


def sets(of: Problem) -> FloatArray:
    """Parameters (runs, 21) of a fixed seed, in the order of the C program."""
    noise = np.random.default_rng(1)
    numbers = np.tile(c_peer.parameters(of), (RUNS, 1))
    for column in _VARIED:
        numbers[:, column] *= 1.0 + _SPREAD * noise.standard_normal(RUNS)
    return numbers


def batches(of: Problem, given: Inputs, folder: Path) -> str:
    """Runs per second of each program that has batches."""
    if not c_peer.SOURCE.exists():
        return f"Not measured: {c_peer.SOURCE.name} is not beside the repository.\n"
    try:
        library = c_peer.Library(folder)
    except (subprocess.CalledProcessError, FileNotFoundError) as fault:
        return f"Not measured: {c_peer.SOURCE.name} does not compile: {fault}\n"
    numbers = sets(of)
    lines = ["| program | threads | runs per second |", "|---|---|---|"]
    for threads in (1, 2):
        seconds = []
        for _ in range(_ROUNDS):
            begin = time.perf_counter()
            library.batch(numbers, of, given, threads)
            seconds.append(time.perf_counter() - begin)
        rate = RUNS / float(np.median(seconds))
        lines.append(f"| {c_peer.PROGRAM} | {threads} | {rate:,.0f} |")
    return "\n".join(lines) + "\n"
