# SPDX-License-Identifier: MIT
"""A C loop with precomputed exponentials for linear problems, hand-written C for the shift."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
from scipy.linalg import expm

from benchmarks.precision.entry import Entry, Problem, compile_c, get_pointer
from benchmarks.precision.linear import TIME, TORQUE, LinearProblem
from benchmarks.precision.shift import BatchProblem, ShiftProblem
from benchmarks.speed import c_peer
from drivetwin.simulation.dual_clutch import FloatArray
from tests.support.upshift.statement import SAMPLES, STEP

NAME = "C loop"
SUBSTEPS = (1, 2, 4, 8)


def list_entries(problem: Problem) -> list[Entry]:
    """List the entries."""
    if isinstance(problem, LinearProblem):
        return [_march(problem)]
    library = c_peer.find_library()
    if library is None:
        return []
    make = _run_batch if isinstance(problem, BatchProblem) else _run_shift
    return [make(problem, library, steps) for steps in SUBSTEPS]


def _march(problem: LinearProblem) -> Entry:
    """Loop over the samples; the exponential is computed beforehand."""
    size, speeds = 2 * len(problem.inertias) - 1, len(problem.inertias)
    source = Path(__file__).with_suffix(".c")
    call = compile_c(source, f"-DN={size}", f"-DSPEEDS={speeds}").march
    step = float(TIME[1] - TIME[0])
    power = expm(problem.augment() * step)
    matrix = np.ascontiguousarray(power[:size, :size])
    held, rising = power[:size, size].copy(), power[:size, size + 1].copy()
    out = np.zeros((TIME.size, speeds))
    arrays = [get_pointer(one) for one in (matrix, held, rising, TORQUE)]
    arguments = (*arrays, ctypes.c_double(step), TIME.size, get_pointer(out))

    def run() -> FloatArray:
        call(*arguments)
        return out

    return Entry("exponential precomputed", run)


def _run_shift(problem: ShiftProblem, library: c_peer.Library, steps: int) -> Entry:
    columns, events = np.zeros((SAMPLES, 4)), np.zeros(64)
    numbers = problem.numbers
    arguments = (
        *(get_pointer(one) for one in numbers),
        *(SAMPLES - 1, ctypes.c_double(STEP), steps, get_pointer(columns)),
        *(get_pointer(events), events.size),
    )

    def run() -> FloatArray:
        _ = numbers  # the arrays that the pointers lead to
        library.functions.shift_sim(*arguments)
        return columns[:, 3]

    return Entry(f"RK4, {steps} steps per sample", run)


def _run_batch(problem: ShiftProblem, library: c_peer.Library, steps: int) -> Entry:
    assert isinstance(problem, BatchProblem)
    of, given, sets = problem.of, problem.given, problem.sets
    setting = f"RK4, {steps} steps per sample"
    return Entry(setting, lambda: library.run_batch(sets, of, given, (1, steps)))
