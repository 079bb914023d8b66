# SPDX-License-Identifier: MIT
"""Kvaerno's implicit method of order 5 in diffrax, compiled by JAX beforehand."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.precision.entry import Entry, Problem
from benchmarks.precision.linear import TIME, TORQUE, LinearProblem
from drivetwin.simulation.dual_clutch import FloatArray

NAME = "diffrax"
TOLERANCES = (1e-4, 1e-6, 1e-8)

jax.config.update("jax_enable_x64", True)


def list_entries(problem: Problem) -> list[Entry]:
    """List the entries: linear problems alone, as its events are no restarts."""
    if not isinstance(problem, LinearProblem):
        return []
    return [Entry(f"Kvaerno5, rtol {one:g}", _prepare(problem, one)) for one in TOLERANCES]


def _prepare(problem: LinearProblem, tolerance: float) -> Callable[[], FloatArray]:
    A, b = map(jnp.asarray, problem.build_system())
    time, torque = jnp.asarray(TIME), jnp.asarray(TORQUE)
    term = diffrax.ODETerm(lambda t, x, _: A @ x + b * jnp.interp(t, time, torque))

    def solve(start: Any) -> Any:
        found = diffrax.diffeqsolve(
            *(term, diffrax.Kvaerno5(), 0.0, TIME[-1], 1e-4, start),
            saveat=diffrax.SaveAt(ts=time),
            stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance),
            max_steps=1_000_000,
        )
        return found.ys

    compiled, start = jax.jit(solve), jnp.zeros(len(A))
    compiled(start).block_until_ready()
    count = len(problem.inertias)
    return lambda: np.asarray(compiled(start).block_until_ready())[:, :count]
