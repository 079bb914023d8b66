# SPDX-License-Identifier: MIT
"""One run of a problem by each program: the speeds with inertia on the grid."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from benchmarks.stiff.problem import TIME, TORQUE, Problem
from drivetwin.simulation.dual_clutch import FloatArray
from drivetwin.simulation.network import Output, simulate

TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10)
"""Relative and absolute tolerances of the other programs."""
_STEPS = 1_000_000
Method = Literal["LSODA", "Radau"]
_METHODS: tuple[Method, ...] = ("LSODA", "Radau")


@dataclass(frozen=True, eq=False)
class Entry:
    """A program with its setting and problem; `run` returns the speeds, None for a failed run."""

    problem: Problem
    program: str
    setting: str
    run: Callable[[], FloatArray | None]


def list_entries(problem: Problem) -> list[Entry]:
    """List the programs that are installed, drivetwin first."""
    entries = [Entry(problem, "drivetwin", "called from Python", _prepare_core(problem))]
    entries.append(Entry(problem, "SciPy expm", "exact over a step", _prepare_expm(problem)))
    for tolerance in TOLERANCES:
        setting = f"rtol {tolerance:g}"
        for method in _METHODS:
            run = _prepare_scipy(problem, method, tolerance)
            entries.append(Entry(problem, f"SciPy {method}", setting, run))
        if has_sundials():
            run = _prepare_cvode(problem, tolerance)
            entries.append(Entry(problem, "CVODE, BDF (scikit-sundae)", setting, run))
    return entries


def has_sundials() -> bool:
    """Return True if scikit-sundae is installed."""
    return importlib.util.find_spec("sksundae") is not None


def _prepare_core(problem: Problem) -> Callable[[], FloatArray | None]:
    elements, inputs, start = problem.elements, problem.inputs, problem.start
    outputs: list[Output] = [("speed", f"n{i}") for i in problem.heavy]

    def run() -> FloatArray | None:
        done = simulate(elements, inputs, start, TIME, outputs)
        return np.array(list(done.columns.values())).T if done.status == "completed" else None

    return run


def _prepare_expm(problem: Problem) -> Callable[[], FloatArray | None]:
    whole = problem.augment() * (TIME[1] - TIME[0])

    def run() -> FloatArray | None:
        return problem.march(expm(whole))

    return run


def _interpolate(time: float) -> float:
    place = min(int(time * 1e3), len(TORQUE) - 2)
    share = time * 1e3 - place
    return float(TORQUE[place] + share * (TORQUE[place + 1] - TORQUE[place]))


def _prepare_scipy(
    problem: Problem, method: Method, tolerance: float
) -> Callable[[], FloatArray | None]:
    A, b = problem.build_system()
    span, start = (0.0, float(TIME[-1])), np.zeros(len(A))

    def rates(time: float, state: FloatArray) -> FloatArray:
        return A @ state + b * _interpolate(time)

    def run() -> FloatArray | None:
        jacobian = (lambda _time, _state: A) if method == "LSODA" else A
        options: dict[str, Any] = {"rtol": tolerance, "atol": tolerance, "jac": jacobian}
        done = solve_ivp(rates, span, start, method, TIME, **options)
        return done.y[: len(problem.heavy)].T if done.success else None

    return run


def _prepare_cvode(problem: Problem, tolerance: float) -> Callable[[], FloatArray | None]:
    cvode = importlib.import_module("sksundae.cvode")
    A, b = problem.build_system()

    def set_rates(time: float, state: FloatArray, rates: FloatArray) -> None:
        rates[:] = A @ state + b * _interpolate(time)

    def set_jacobian(
        _time: float, _state: FloatArray, _rates: FloatArray, jacobian: FloatArray
    ) -> None:
        jacobian[:] = A

    def run() -> FloatArray | None:
        solver = cvode.CVODE(
            set_rates, rtol=tolerance, atol=tolerance, jacfn=set_jacobian, max_num_steps=_STEPS
        )
        done = solver.solve(TIME, np.zeros(len(A)))
        return np.asarray(done.y)[:, : len(problem.heavy)] if done.success else None

    return run
