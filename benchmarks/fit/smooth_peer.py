# SPDX-License-Identifier: MIT
"""Least squares on a smooth model in CasADi: CVODES with forward sensitivities."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.fit.problem import Problem, Realisation
from benchmarks.fit.smooth_models import SMOOTH
from drivetwin._util.arrays import FloatArray

RELATIVE, ABSOLUTE = 1e-6, 1e-8
"""Tolerances of CVODES. At 1e-4 its steps miss lock-ups, and differences of its runs are noise."""


class SmoothProblem:
    """Smooth model of a realisation: outputs and their derivatives by unknowns and start values.

    Raises ImportError where CasADi is not installed.
    """

    def __init__(self, problem: Problem, drawn: Realisation) -> None:
        import casadi

        model = SMOOTH[problem.name]
        names = [*problem.unknowns, *problem.open_start]
        point = casadi.MX.sym("point", len(names))
        values = {name: point[place] for place, name in enumerate(problem.unknowns)}
        start: dict[str, Any] = {name: drawn.start[name] for name in problem.known}
        start |= {one: point[len(values) + k] for k, one in enumerate(problem.open_start)}
        begin = model.begin(values, start)
        begun = casadi.vertcat(*(begin[name] for name in model.states))
        grid = problem.time
        integrator = self._make_integrator(problem, drawn)
        states = integrator(x0=begun, p=point)["xf"]
        states = casadi.horzcat(begun, states[:, : grid.size - 1])
        rows = {name: states[k, :] for k, name in enumerate(model.states)}
        read = model.read(rows, values)
        outputs = casadi.vertcat(*(read[name] for name in problem.outputs))
        flat = casadi.reshape(outputs.T, -1, 1)
        self._outputs = casadi.Function("outputs", [point], [flat])
        self._slopes = casadi.Function("slopes", [point], [flat, casadi.jacobian(flat, point)])

    @staticmethod
    def _make_integrator(problem: Problem, drawn: Realisation) -> Any:
        """Return the integrator from the start to all later instants of the grid."""
        import casadi

        model = SMOOTH[problem.name]
        state = casadi.MX.sym("state", len(model.states))
        point = casadi.MX.sym("point", len(problem.unknowns) + len(problem.open_start))
        now = casadi.MX.sym("now")
        signals = {
            name: casadi.interpolant(
                f"input{place}", "linear", [one.time.tolist()], one.values.tolist()
            )(now)
            for place, (name, one) in enumerate(drawn.inputs.items())
        }
        values = {name: point[place] for place, name in enumerate(problem.unknowns)}
        named = {name: state[k] for k, name in enumerate(model.states)}
        rates = model.rates(named, values, signals)
        ode = {
            "x": state,
            "p": point,
            "t": now,
            "ode": casadi.vertcat(*(rates[name] for name in model.states)),
        }
        how = {
            "reltol": RELATIVE,
            "abstol": ABSOLUTE,
            "max_num_steps": 1_000_000,
            "print_stats": False,
            "show_eval_warnings": False,
        }
        grid = problem.time.tolist()
        return casadi.integrator("run", "cvodes", ode, grid[0], grid[1:], how)

    def simulate(self, point: FloatArray) -> FloatArray:
        """Return the outputs (m·n,) at unknowns and start values (p,)."""
        return np.asarray(self._outputs(point)).ravel()

    def differentiate(self, point: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the outputs (m·n,) and their derivatives (m·n, p)."""
        values, slopes = self._slopes(point)
        return np.asarray(values).ravel(), np.asarray(slopes)
