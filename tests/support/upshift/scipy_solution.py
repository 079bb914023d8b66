# SPDX-License-Identifier: MIT
"""Solution of the stated upshift by `solve_ivp` of SciPy, from event to event."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from scipy.integrate import solve_ivp

from tests.support.arrays import FloatArray
from tests.support.upshift.equations import FIRST_MODE, Equations, Guard, Mode
from tests.support.upshift.statement import SAMPLES, STEP, Solution

_MOST_EVENTS = 100
Method = Literal["RK45", "LSODA", "Radau"]


def solve(
    equations: Equations,
    instants: FloatArray,
    method: Method,
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
            _make_rate(equations, mode),
            (t, end),
            np.array(x),
            method=method,
            t_eval=instants[ahead:],
            events=[_make_event(guard) for _, guard in guards],
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


def _make_rate(equations: Equations, mode: Mode) -> Callable[[float, FloatArray], list[float]]:
    return lambda t, x: equations.evaluate(t, x.tolist(), mode)[0]


def _make_event(guard: Guard) -> Callable[[float, FloatArray], float]:
    def event(t: float, x: FloatArray) -> float:
        return guard(t, x.tolist())

    event.terminal = True  # type: ignore[attr-defined]
    event.direction = -1.0  # type: ignore[attr-defined]
    return event
