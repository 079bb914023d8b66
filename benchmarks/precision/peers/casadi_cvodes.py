# SPDX-License-Identifier: MIT
"""CVODES of CasADi, whose input is the slope of the torque between samples."""

from __future__ import annotations

import casadi
import numpy as np

from benchmarks.precision.entry import TOLERANCES, Entry, Problem
from benchmarks.precision.linear import TIME, TORQUE, LinearProblem
from drivetwin.simulation.dual_clutch import FloatArray

NAME = "CasADi CVODES"


def list_entries(problem: Problem) -> list[Entry]:
    """List the entries: linear problems alone, as its events fire in one direction."""
    if not isinstance(problem, LinearProblem):
        return []
    return [_prepare(problem, one) for one in TOLERANCES]


def _prepare(problem: LinearProblem, tolerance: float) -> Entry:
    A, b = problem.build_system()
    x, slope = casadi.SX.sym("x", len(A) + 1), casadi.SX.sym("slope")
    rates = casadi.vertcat(casadi.DM(A) @ x[:-1] + casadi.DM(b) * x[-1], slope)
    options = {"reltol": tolerance, "abstol": tolerance, "max_num_steps": 1_000_000}
    call = casadi.integrator(
        "run", "cvodes", {"x": x, "u": slope, "ode": rates}, 0.0, TIME[1:].tolist(), options
    )
    slopes = np.diff(TORQUE) / np.diff(TIME)
    start = np.concatenate([np.zeros(len(A)), TORQUE[:1]])
    count = len(problem.inertias)

    def run() -> FloatArray | None:
        try:
            found = np.array(call(x0=start, u=slopes[None, :])["xf"])
        except RuntimeError:  # it gives up
            return None
        return np.vstack([np.zeros(count), found[:count].T])

    return Entry(f"rtol {tolerance:g}", run)
