# SPDX-License-Identifier: MIT
"""LSODA and Radau of SciPy with a right-hand side compiled by Numba, restarted at events."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp

from benchmarks.precision.compiled_shift import CompiledEquations
from benchmarks.precision.entry import TOLERANCES, Entry, Problem
from benchmarks.precision.linear import TIME, TORQUE, LinearProblem
from benchmarks.precision.shift import BatchProblem, ShiftProblem
from drivetwin.simulation.dual_clutch import FloatArray
from tests.support.upshift.scipy_solution import solve

NAME = "SciPy, compiled"
METHODS: tuple[Literal["LSODA", "Radau"], ...] = ("LSODA", "Radau")


@njit
def rates(t, x, A, b, u):  # type: ignore[no-untyped-def]
    """Rates of a linear problem."""
    place = min(int(t * 1e3), u.size - 2)
    return A @ x + b * (u[place] + (t * 1e3 - place) * (u[place + 1] - u[place]))


def list_entries(problem: Problem) -> list[Entry]:
    """List the entries; sets of a batch run one by one, as the shift does."""
    if isinstance(problem, BatchProblem):
        return []
    make: Callable[..., FloatArray | None] = _shift
    if isinstance(problem, LinearProblem):
        make = _integrate
    make(problem, METHODS[0], 1e-2)  # compiles
    return [
        Entry(f"{method}, rtol {one:g}", functools.partial(make, problem, method, one))
        for method in METHODS
        for one in TOLERANCES
    ]


def _integrate(problem: LinearProblem, method: Any, tolerance: float) -> FloatArray | None:
    A, b = problem.build_system()
    jacobian: Any = (lambda *_: A) if method == "LSODA" else A
    options: Any = {"args": (A, b, TORQUE), "rtol": tolerance, "atol": tolerance, "jac": jacobian}
    span = (0.0, float(TIME[-1]))
    done: Any = solve_ivp(rates, span, np.zeros(len(A)), method, TIME, **options)
    return np.asarray(done.y[: len(problem.inertias)].T) if done.success else None


def _shift(problem: ShiftProblem, method: Any, tolerance: float) -> FloatArray:
    accuracy = (tolerance, 1e-2 * tolerance, 1e-2)
    found = solve(CompiledEquations(problem), problem.given.time, method, accuracy)
    return np.asarray(found.columns[3])
