# SPDX-License-Identifier: MIT
"""LSODA of NumbaLSODA: integrator and equations compiled, without a call of Python."""

from __future__ import annotations

import functools

import numpy as np
from numba import carray, cfunc
from numbalsoda import lsoda, lsoda_sig

from benchmarks.precision.entry import TOLERANCES, Entry, Problem
from benchmarks.precision.linear import TIME, TORQUE, LinearProblem
from drivetwin.simulation.dual_clutch import FloatArray

NAME = "NumbaLSODA"


@cfunc(lsoda_sig)
def rates(t, x, out, data):  # type: ignore[no-untyped-def]
    """Rates of a linear problem; `data` is size, samples, A, b and u behind each other."""
    head = carray(data, (2,))
    n, count = int(head[0]), int(head[1])
    given = carray(data, (2 + n * n + n + count,))
    u = given[2 + n * n + n :]
    k = min(int(t * 1e3), count - 2)
    value = u[k] + (t * 1e3 - k) * (u[k + 1] - u[k])
    for i in range(n):
        total = given[2 + n * n + i] * value
        for j in range(n):
            total += given[2 + n * i + j] * x[j]
        out[i] = total


def list_entries(problem: Problem) -> list[Entry]:
    """List the entries: linear problems alone, as it finds no events."""
    if not isinstance(problem, LinearProblem):
        return []
    A, b = problem.build_system()
    given = np.concatenate([[len(A), TORQUE.size], A.ravel(), b, TORQUE])
    return [
        Entry(f"rtol {one:g}", functools.partial(_run, problem, given, one)) for one in TOLERANCES
    ]


def _run(problem: LinearProblem, given: FloatArray, tolerance: float) -> FloatArray | None:
    start = np.zeros(int(given[0]))
    options = {"data": given, "rtol": tolerance, "atol": tolerance, "mxstep": 1_000_000}
    found, success = lsoda(rates.address, start, TIME, **options)
    return found[:, : len(problem.inertias)] if success else None
