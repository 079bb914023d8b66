# SPDX-License-Identifier: MIT
"""SUNDIALS CVODE with root finding, through scikit-sundae."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from benchmarks.speed.equations import FIRST_MODE, Equations, Mode
from benchmarks.speed.measure import Entry, Judge, Skipped, timed
from benchmarks.speed.statement import Inputs, Problem, Solution
from drivetwin.driveline import FloatArray

if TYPE_CHECKING:
    from sksundae.cvode import CVODEResult

_MOST_EVENTS, _MOST_STEPS, _LONGEST_STEP = 100, 100_000, 1e-2


def entries(of: Problem, given: Inputs, judge: Judge) -> list[Entry] | Skipped:
    """Adams at a usual tolerance, BDF at a tight one."""
    try:
        import sksundae  # noqa: F401
    except ImportError:
        return Skipped("SUNDIALS CVODE", "scikit-sundae is not installed (group `bench`)")
    equations = Equations(of, given)

    def entry(method: str, rtol: float, atol: float) -> Entry:
        def run() -> Solution:
            return _solve(equations, given.time, method, (rtol, atol))

        setting = f"{method}, rtol {rtol:g}, root finding"
        return Entry("SUNDIALS CVODE, Python", setting, lambda: timed(run, 1), judge, rounds=3)

    return [entry("Adams", 1e-6, 1e-8), entry("BDF", 1e-9, 1e-10)]


def _solve(
    equations: Equations, instants: FloatArray, method: str, accuracy: tuple[float, float]
) -> Solution:
    t, x, mode = 0.0, list(equations.start), FIRST_MODE
    columns = np.full((4, instants.size), np.nan)
    events: list[float] = []
    columns[:, 0] = x
    while len(events) < _MOST_EVENTS:
        ahead = int(np.searchsorted(instants, t, side="right"))
        times = np.concatenate([[t], instants[ahead:]])
        found = _piece(equations, mode, (times, x), method, accuracy)
        stopped = found.t_events is not None
        reached = found.t.size - 1 - int(stopped)
        columns[:, ahead : ahead + reached] = found.y[1 : 1 + reached].T
        if not stopped:
            break
        t, x = float(found.t_events[-1]), found.y_events[-1].tolist()
        fired = int(np.flatnonzero(found.i_events[-1])[0])
        events.append(t)
        x, mode = equations.after(t, x, mode, equations.guards(mode)[fired][0])
    columns[3] += equations.of.c * (columns[1] - equations.of.i_f * columns[2])
    return Solution(columns, np.array(events))


def _piece(
    equations: Equations,
    mode: Mode,
    begin: tuple[FloatArray, list[float]],
    method: str,
    accuracy: tuple[float, float],
) -> CVODEResult:
    """Integrate over instants from a state, to the first event at most."""
    from sksundae.cvode import CVODE

    guards = [guard for _, guard in equations.guards(mode)]

    def rates(t: float, x: FloatArray, rate: FloatArray) -> None:
        rate[:] = equations.evaluate(t, x.tolist(), mode)[0]

    def events(t: float, x: FloatArray, values: FloatArray) -> None:
        state = x.tolist()
        values[:] = [guard(t, state) for guard in guards]

    events.direction = [-1] * len(guards)  # type: ignore[attr-defined]
    solver = CVODE(
        rates,
        method=method,
        rtol=accuracy[0],
        atol=accuracy[1],
        max_step=_LONGEST_STEP,
        max_num_steps=_MOST_STEPS,
        eventsfn=events,
        num_events=len(guards),
    )
    return solver.solve(*begin)
