# SPDX-License-Identifier: MIT
"""CVODE through scikit-sundae, its equations compiled by Numba but called from Python."""

from __future__ import annotations

import functools

import numpy as np
from numba import njit
from sksundae.cvode import CVODE

from benchmarks.precision.entry import TOLERANCES, Entry, Problem
from benchmarks.precision.linear import TIME, TORQUE, LinearProblem
from drivetwin.simulation.dual_clutch import FloatArray

NAME = "scikit-sundae"


@njit
def set_rates(t, x, out, given):  # type: ignore[no-untyped-def]
    """Set the rates of a linear problem."""
    A, b, u = given
    k = min(int(t * 1e3), u.size - 2)
    out[:] = A @ x + b * (u[k] + (t * 1e3 - k) * (u[k + 1] - u[k]))


def list_entries(problem: Problem) -> list[Entry]:
    """List the entries: linear problems alone, as it is CVODE once more."""
    if not isinstance(problem, LinearProblem):
        return []
    _integrate(problem, 1e-2)  # compiles
    return [
        Entry(f"BDF, rtol {one:g}", functools.partial(_integrate, problem, one))
        for one in TOLERANCES
    ]


def _integrate(problem: LinearProblem, tolerance: float) -> FloatArray | None:
    A, b = problem.build_system()

    def set_jacobian(_t, _x, _rates, out, _given):  # type: ignore[no-untyped-def]
        out[:] = A

    accuracy = {"rtol": tolerance, "atol": tolerance, "max_num_steps": 1_000_000}
    solver = CVODE(set_rates, userdata=(A, b, TORQUE), jacfn=set_jacobian, **accuracy)
    done = solver.solve(TIME, np.zeros(len(A)))
    return np.asarray(done.y)[:, : len(problem.inertias)] if done.success else None
