# SPDX-License-Identifier: MIT
"""SciPy: `solve_ivp` from event to event."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.speed.equations import FIRST_MODE, Equations, Guard, Mode
from benchmarks.speed.measure import Entry, Judge, timed
from benchmarks.speed.statement import SAMPLES, STEP, Inputs, Problem, Solution
from drivetwin.driveline import FloatArray

_MOST_EVENTS = 100
_Method = Literal["RK45", "LSODA"]


def entries(of: Problem, given: Inputs, judge: Judge) -> list[Entry]:
    """RK45 and LSODA at a loose and a usual tolerance."""
    equations = Equations(of, given)

    def entry(method: _Method, rtol: float, atol: float, max_step: float) -> Entry:
        def run() -> Solution:
            return solve(equations, given.time, method, (rtol, atol, max_step))

        setting = f"{method}, rtol {rtol:g}, restart at events"
        return Entry("SciPy", setting, lambda: timed(run, 1), judge, rounds=3)

    return [
        entry("RK45", 1e-3, 1e-6, np.inf),
        entry("RK45", 1e-6, 1e-8, 1e-2),
        entry("LSODA", 1e-3, 1e-6, np.inf),
        entry("LSODA", 1e-6, 1e-8, 1e-2),
    ]


def solve(
    equations: Equations,
    instants: FloatArray,
    method: _Method,
    accuracy: tuple[float, float, float],
) -> Solution:
    """Integrate piece by piece; `accuracy` is rtol, atol and the longest step [s]."""
    rtol, atol, max_step = accuracy
    t, x, mode = 0.0, list(equations.start), FIRST_MODE
    columns = np.full((4, instants.size), np.nan)
    events: list[float] = []
    end = STEP * (SAMPLES - 1)
    while len(events) < _MOST_EVENTS:
        guards = equations.guards(mode)
        ahead = int(np.searchsorted(instants, t))
        piece = solve_ivp(
            _rate(equations, mode),
            (t, end),
            np.array(x),
            method=method,
            t_eval=instants[ahead:],
            events=[_terminal(guard) for _, guard in guards],
            rtol=rtol,
            atol=atol,
            max_step=max_step,
        )
        columns[:, ahead : ahead + piece.t.size] = piece.y
        found = zip(piece.t_events or [], piece.y_events or [], guards, strict=True)
        fired = [(times[0], states[0], guard) for times, states, guard in found if times.size]
        if not fired:
            break
        t, x = float(fired[0][0]), fired[0][1].tolist()
        events.append(t)
        x, mode = equations.after(t, x, mode, fired[0][2][0])
    columns[3] += equations.of.c * (columns[1] - equations.of.i_f * columns[2])
    return Solution(columns, np.array(events))


def _rate(equations: Equations, mode: Mode) -> Callable[[float, FloatArray], list[float]]:
    return lambda t, x: equations.evaluate(t, x.tolist(), mode)[0]


def _terminal(guard: Guard) -> Callable[[float, FloatArray], float]:
    def event(t: float, x: FloatArray) -> float:
        return guard(t, x.tolist())

    event.terminal = True  # type: ignore[attr-defined]
    event.direction = -1.0  # type: ignore[attr-defined]
    return event
