# SPDX-License-Identifier: MIT
"""CVODE of SUNDIALS, called from C: BDF for linear problems, Adams with roots for the shift."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np

from benchmarks.precision.entry import TOLERANCES, Entry, Problem, compile_c, get_pointer
from benchmarks.precision.linear import TIME, TORQUE, LinearProblem
from benchmarks.precision.shift import BatchProblem, ShiftProblem
from benchmarks.speed import c_peer
from drivetwin.simulation.dual_clutch import FloatArray
from tests.support.upshift.statement import SAMPLES, STEP

NAME = "CVODE in C"
LIBRARIES = ("-lsundials_cvode", "-lsundials_nvecserial")
STOP_AT_SAMPLES = 1
"""The integrator of the shift stops at the kinks of its inputs."""


def list_entries(problem: Problem) -> list[Entry]:
    """List the entries."""
    if isinstance(problem, LinearProblem):
        return [_integrate(problem, one) for one in TOLERANCES]
    source = c_peer.SOURCE.with_name("cv.c")
    if not source.exists():
        return []
    call = compile_c(source, *LIBRARIES).cv_sim
    return [_shift(problem, call, one) for one in TOLERANCES]


def _integrate(problem: LinearProblem, tolerance: float) -> Entry:
    size, speeds = 2 * len(problem.inertias) - 1, len(problem.inertias)
    options = (f"-DSTATES={size}", f"-DSPEEDS={speeds}", *LIBRARIES)
    call = compile_c(Path(__file__).with_suffix(".c"), *options).solve
    A, b = problem.build_system()
    out, step = np.zeros((TIME.size, speeds)), ctypes.c_double(TIME[1] - TIME[0])

    def run() -> FloatArray | None:
        arrays = [get_pointer(one) for one in (A, b, TORQUE)]
        status = call(*arrays, step, TIME.size, ctypes.c_double(tolerance), get_pointer(out))
        return out if status >= 0 else None

    return Entry(f"BDF, rtol {tolerance:g}", run)


def _shift(problem: ShiftProblem, call: ctypes._NamedFuncPointer, tolerance: float) -> Entry:
    numbers, first, samples = problem.numbers
    sets = problem.sets if isinstance(problem, BatchProblem) else numbers[None, :]
    columns, events, count = np.zeros((SAMPLES, 4)), np.zeros(300), ctypes.c_long()
    torques = np.zeros((len(sets), SAMPLES))
    accuracy = (ctypes.c_double(tolerance), ctypes.c_double(1e-2 * tolerance))

    def run() -> FloatArray:
        for torque, one in zip(torques, np.ascontiguousarray(sets), strict=True):
            call(
                *(get_pointer(one), get_pointer(first), get_pointer(samples)),
                *(SAMPLES - 1, ctypes.c_double(STEP), *accuracy, 0, STOP_AT_SAMPLES),
                *(get_pointer(columns), get_pointer(events), events.size, ctypes.byref(count)),
            )
            torque[:] = columns[:, 3]
        return torques if isinstance(problem, BatchProblem) else torques[0]

    return Entry(f"Adams, rtol {tolerance:g}", run)
