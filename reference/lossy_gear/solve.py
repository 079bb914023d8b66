# SPDX-License-Identifier: MIT
"""SciPy solution, from the equations in the README of this folder."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from reference.march import Array, March
from reference.tables import Change, Solution, Table

ETA, J_A, J_B = 0.5, 1.0, 1.5
END = 0.5
Drag = Callable[[float], float]
"""Friction torque at a over the size of its speed."""


def acceleration(t: float, speed: float, direction: float, drag: Drag) -> tuple[float, float]:
    """Of shaft b when it turns in a direction, and the torque through the gear that goes with it.

    Of the two efficiencies the one holds whose torque has the sign that it is for.
    """
    entering = 10.0 * math.sin(2.0 * math.pi * t) - direction * drag(abs(2.0 * speed))
    load = -10.0 + 2.5 * t
    found = []
    for factor, sense in ((ETA, 1.0), (1.0 / ETA, -1.0)):
        value = (load + 2.0 * factor * entering) / (J_B + 4.0 * factor * J_A)
        through = entering - 2.0 * J_A * value
        found.append((sense * direction * through, value, through))
    _, value, through = max(found)
    return value, through


def moving(t: float, drag: Drag) -> float:
    """Direction in which shaft b leaves rest, 0 if it stays there."""
    directions = (d for d in (1.0, -1.0) if d * acceleration(t, 0.0, d, drag)[0] > 0.0)
    return next(directions, 0.0)


def solve(time: Array, element: str, drag: Drag) -> Solution:
    """Speeds and angle at `time` (n,) [s]; changes are those of `element`."""
    march = March([0.0, 0.0], time)
    changes: list[Change] = []
    direction = moving(1e-9, drag)
    while march.t < END:
        way = direction

        def rate(t: float, x: Array, way: float = way) -> Array:
            return np.array([acceleration(t, x[0], way, drag)[0] if way else 0.0, x[0]])

        def through(t: float, x: Array, way: float = way) -> float:
            return acceleration(t, x[0], way, drag)[1]

        def reserve(t: float, _x: Array, away: float) -> float:
            return -away * acceleration(t, 0.0, away, drag)[0]

        if way:
            gaps, kinks = [lambda _t, x, w=way: float(w * x[0])], [through]
        else:
            gaps = [lambda t, x: reserve(t, x, 1.0), lambda t, x: reserve(t, x, -1.0)]
            kinks = []
        fired = march.advance(rate, END, gaps, lambda _t, x: (2.0 * x[0], x[0], x[1]), kinks)
        if fired is None:
            break
        if way:
            march.x[0] = 0.0
            direction = moving(march.t + 1e-9, drag)
            changes.append(Change(march.t, element, "reverse" if direction else "lock"))
        else:
            direction = (1.0, -1.0)[fired]
            changes.append(Change(march.t, element, "break_away"))
    columns = zip((("speed", "a"), ("speed", "b"), ("angle", "b")), march.columns(), strict=True)
    return Solution(Table(time, dict(columns)), tuple(changes))


def solution(time: Array) -> Solution:
    """Speeds and angle at `time` (n,) [s]."""
    return solve(time, "gear", lambda _speed: 0.0)
