# SPDX-License-Identifier: MIT
"""SciPy solution, from the equations in the README of this folder."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from reference.march import Array, Gap, March
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


class Motion:
    """Speed and angle of shaft b while it turns in one direction or rests (0)."""

    def __init__(self, direction: float, drag: Drag) -> None:
        self.direction = direction
        self.drag = drag

    def rate(self, t: float, x: Array) -> Array:
        """Of speed and angle."""
        if not self.direction:
            return np.array([0.0, x[0]])
        return np.array([acceleration(t, x[0], self.direction, self.drag)[0], x[0]])

    def gaps(self) -> list[Gap]:
        """What ends it: no speed, or at rest what keeps it from moving either way."""
        if self.direction:
            return [lambda _t, x: float(self.direction * x[0])]
        return [self._reserve(way) for way in (1.0, -1.0)]

    def kinks(self) -> list[Gap]:
        """Where the direction of power changes."""
        if not self.direction:
            return []
        return [lambda t, x: acceleration(t, x[0], self.direction, self.drag)[1]]

    def _reserve(self, way: float) -> Gap:
        return lambda t, _x: -way * acceleration(t, 0.0, way, self.drag)[0]


def solve(time: Array, element: str, drag: Drag) -> Solution:
    """Speeds and angle at `time` (n,) [s]; changes are those of `element`."""
    march = March([0.0, 0.0], time)
    changes: list[Change] = []
    motion = Motion(moving(1e-9, drag), drag)
    while march.t < END:
        gaps, kinks = motion.gaps(), motion.kinks()
        fired = march.advance(motion.rate, END, gaps, lambda _t, x: (2.0 * x[0], x[0], x[1]), kinks)
        if fired is None:
            break
        if motion.direction:
            march.x[0] = 0.0
            motion = Motion(moving(march.t + 1e-9, drag), drag)
            changes.append(Change(march.t, element, "reverse" if motion.direction else "lock"))
        else:
            motion = Motion((1.0, -1.0)[fired], drag)
            changes.append(Change(march.t, element, "break_away"))
    columns = zip((("speed", "a"), ("speed", "b"), ("angle", "b")), march.columns(), strict=True)
    return Solution(Table(time, dict(columns)), tuple(changes))


def solution(time: Array) -> Solution:
    """Speeds and angle at `time` (n,) [s]."""
    return solve(time, "gear", lambda _speed: 0.0)
