# SPDX-License-Identifier: MIT
"""The stated upshift by given profiles, or under a closed slip loop, by `solve_ivp` of SciPy.

Written from the description of controller and actuator, without code of the program: the controller
in plain Python, the lag of the actuators as a differential equation, the driveline as in
`equations`. Inputs of the closed loop are linear between samples at 1 kHz.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from tests.support.arrays import FloatArray
from tests.support.upshift.equations import FIRST_MODE, Clutch, Contact, Equations, Mode
from tests.support.upshift.scipy_solution import _make_event, _make_rate
from tests.support.upshift.statement import STEP, Inputs, Problem

_RTOL, _ATOL = 1e-9, 1e-9
PER_TASK = 10
"""Samples of a controller task."""
Corners = tuple[FloatArray, FloatArray]


@dataclass
class Valve:
    """Actuator without hysteresis and fill: a dead time [s] and a lag of second order."""

    dead_time: float
    rising: float
    falling: float
    damping: float
    pressure: float
    rate: float = 0.0
    commands: list[tuple[float, float]] = field(default_factory=list)

    def pass_to(self, begin: float, end: float) -> float:
        """Integrate over a time; return the pressure at its end."""
        arrivals = [(t + self.dead_time, value) for t, value in self.commands]
        edges = [begin, *(t for t, _ in arrivals if begin < t < end), end]
        for first, last in pairwise(edges):
            middle = 0.5 * (first + last)
            wanted = [value for t, value in arrivals if t <= middle][-1]

            def rates(_: float, x: FloatArray, wanted: float = wanted) -> list[float]:
                rises = x[0] < wanted or (x[0] == wanted and x[1] <= 0.0)
                constant = self.rising if rises else self.falling
                pull = (wanted - x[0]) / constant - 2.0 * self.damping * x[1]
                return [x[1], pull / constant]

            at = np.array([self.pressure, self.rate])
            piece = solve_ivp(rates, (first, last), at, rtol=1e-9, atol=1e-4)
            self.pressure, self.rate = piece.y[:, -1].tolist()
        return self.pressure


class Controller:
    """The controller of a shift, by its parameters `of` in SI."""

    def __init__(self, of: Mapping[str, float]) -> None:
        self.of = of
        self.began: tuple[float, float] | None = None
        self.locking: tuple[float, float] | None = None
        self.returning: tuple[float, float] | None = None
        self.integral = self.left = 0.0
        self.last = of["engine_torque"], of["system_pressure"], 0.0

    def command(self, t: float, slips: tuple[float, float]) -> tuple[float, float, float]:
        """Return engine torque, off-going and on-coming pressure by slips [rad/s] at a task."""
        after, (old, new) = t - self.of["request"] + 1e-9, slips
        if self.began is None and after > 0.03 and abs(old) > 1.5:
            self.began = t, new
            self.left = abs(new)
        left = 0.0
        if self.began is not None:
            left = new if self.began[1] >= 0.0 else -new
            passed, plan = t - self.began[0], self.of["inertia_time"]
            rate = (left - self.left) / self.of["task"]
            late = passed > 2.5 * plan or (passed > plan and rate >= 0.0)
            ahead = left + min(rate, 0.0) * self.of["lock_lead"]
            if self.locking is None and (ahead < 0.5 or late):
                self.locking = t, self.last[2]
            self.left = left
        top = self.of["system_pressure"]
        pressures = (self._release(after), self._engage(t, after, left))
        off, on = (min(max(one, 0.0), top) for one in pressures)
        self.last = self._demand(t, left), off, on
        return self.last

    def _release(self, after: float) -> float:
        of = self.of
        corners = (0.0, of["hold_time"], of["hold_time"] + of["release_time"])
        return float(np.interp(after, corners, (of["system_pressure"], of["hold_pressure"], 0.0)))

    def _engage(self, t: float, after: float, left: float) -> float:
        of = self.of
        if self.locking is not None:
            return self.locking[1] + of["lock_rate"] * (t - self.locking[0])
        if self.began is not None:
            begin, slip = self.began
            share = min((t - begin) / of["inertia_time"], 1.0)
            rest = 1.0 - share
            smooth = rest**2 * (3.0 - 2.0 * rest)
            plan = abs(slip) * (of["end_slope"] * rest + (1.0 - of["end_slope"]) * smooth)
            error = left - plan
            self.integral += of["integral_gain"] * error * of["task"]
            feed = of["inertia_pressure"] + (of["sync_pressure"] - of["inertia_pressure"]) * share
            return feed + of["gain"] * error + self.integral
        if after < 0.0:
            return 0.0
        if after < of["fill_time"]:
            return of["fill_pressure"]
        end = of["fill_time"] + of["torque_phase_time"]
        span = (of["kiss_pressure"], of["handover_pressure"])
        return float(np.interp(after, (of["fill_time"], end), span))

    def _demand(self, t: float, left: float) -> float:
        of = self.of
        if self.began is None:
            return of["engine_torque"]
        begin, slip = self.began
        if self.returning is None and (self.locking or left < of["return_slip"] * abs(slip)):
            self.returning = t, self.last[0]
        if self.returning is not None:
            since, level = self.returning
            ends = (since, since + of["return_time"])
            return float(np.interp(t, ends, (level, of["engine_torque"])))
        start = begin + of["reduction_delay"]
        reduced = of["engine_torque"] + of["direction"] * of["reduction_depth"]
        return float(
            np.interp(t, (start, start + of["reduction_time"]), (of["engine_torque"], reduced))
        )


class Given(Equations):
    """The driveline with inputs that are linear between `corners` (times, values) of each."""

    def __init__(self, of: Problem, start: Inputs, corners: Sequence[Corners]) -> None:
        super().__init__(of, start)
        self._corners = corners

    def input(self, which: int, t: float) -> float:
        return float(np.interp(t, *self._corners[which]))

    def prepare(self, first: int, slips: tuple[float, float]) -> None:
        """Nothing: all inputs are known."""


class Controlled(Equations):
    """The driveline behind a controller and its actuators; `given` are parameters in SI."""

    def __init__(
        self, of: Problem, start: Inputs, given: Mapping[str, float], valves: tuple[Valve, Valve],
        engine_lag: float,
    ) -> None:  # fmt: skip
        super().__init__(of, start)
        self._controller, self._valves = Controller(given), valves
        self._decay = float(np.exp(-STEP / engine_lag))

    def prepare(self, first: int, slips: tuple[float, float]) -> None:
        """Fill in the inputs of the task that begins at a sample, by the slips there."""
        wanted = self._controller.command(STEP * first, slips)
        for valve, command in zip(self._valves, wanted[1:], strict=True):
            valve.commands.append((STEP * first, command))
        torque, *pressures = self._inputs
        for k in range(first, first + PER_TASK):
            torque[k + 1] = wanted[0] + (torque[k] - wanted[0]) * self._decay
            for valve, pressure in zip(self._valves, pressures, strict=True):
                pressure[k + 1] = valve.pass_to(STEP * k, STEP * (k + 1))


def solve_tasks(equations: Given | Controlled, count: int) -> tuple[FloatArray, float]:
    """Simulate `count` samples task by task.

    Return T_o [N m], then torque [N m] and slip [rad/s] of both clutches (5, count), and the time
    of the last lock-up of the on-coming clutch [s].
    """
    mode, x = FIRST_MODE, list(equations.start)
    columns, lock = np.empty((5, count)), float("nan")
    for first in range(0, count - 1, PER_TASK):
        equations.prepare(first, _read_slips(equations, x, mode))
        x, mode, found = _pass_task(equations, (first, x, mode), columns)
        lock = found if np.isfinite(found) else lock
    columns[:, -1] = _read(equations, STEP * (count - 1), x, mode)
    return columns, lock


def _pass_task(
    equations: Equations, begin: tuple[int, list[float], Mode], columns: FloatArray
) -> tuple[list[float], Mode, float]:
    """Integrate over a task from event to event; return state, mode and time of the last lock."""
    first, x, mode = begin
    t, end, lock = STEP * first, STEP * (first + PER_TASK), np.nan
    at = STEP * np.arange(first, first + PER_TASK)
    while t < end - 1e-12:
        guards = equations.guards(mode)
        instants = at[at >= t]
        piece = solve_ivp(
            _make_rate(equations, mode), (t, end), np.array(x), method="LSODA",
            t_eval=np.append(instants, end), events=[_make_event(one) for _, one in guards],
            rtol=_RTOL, atol=_ATOL, max_step=STEP,
        )  # fmt: skip
        for moment, state in zip(piece.t, np.asarray(piece.y).T, strict=True):
            if moment < end:
                columns[:, round(moment / STEP)] = _read(equations, moment, state.tolist(), mode)
        pairs = zip(piece.t_events or [], piece.y_events or [], guards, strict=True)
        fired = [(times[0], states[0], one) for times, states, one in pairs if times.size]
        if not fired:
            return piece.y[:, -1].tolist(), mode, lock
        t, state, (clutch, _) = min(fired, key=lambda one: float(one[0]))
        x, mode = equations.after(t, state.tolist(), mode, clutch)
        if clutch.number == 1 and mode[1].contact is Contact.STUCK:
            lock = float(t)
    return x, mode, lock


def _read_slips(equations: Equations, x: list[float], mode: Mode) -> tuple[float, float]:
    old, new = (_read_slip(equations, clutch, x) for clutch in mode)
    return old, new


def _read_slip(equations: Equations, clutch: Clutch, x: list[float]) -> float:
    return 0.0 if clutch.contact is Contact.STUCK else equations.slip(clutch.number, x)


def _read(equations: Equations, t: float, x: list[float], mode: Mode) -> list[float]:
    _, torques = equations.evaluate(t, x, mode)
    slips = _read_slips(equations, x, mode)
    return [equations.shaft_torque(x), torques[0], slips[0], torques[1], slips[1]]
