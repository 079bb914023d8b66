# SPDX-License-Identifier: MIT
"""SciPy solution, from the equations in the README of this folder."""

from __future__ import annotations

import math

import numpy as np

from reference.march import Array
from reference.mechanism import Mechanism, solve, speed, state
from reference.tables import Solution


def _force(t: float, _v: Array, _z: Array) -> list[float]:
    return [10.0 * math.sin(10.0 * math.pi * t), 0.0, 0.0, 0.0]


def _capacity(t: float, _slip: Array) -> list[float]:
    first = max(0.0, 10.0 * math.cos(0.4 * math.pi * t)) if t < 1.25 else 0.0
    return [first, 10.0 if t >= 0.4 else 0.0, 10.0 if t >= 0.9 else 0.0]


SYSTEM = Mechanism(
    mass=np.eye(4),
    force=_force,
    elements=("c1", "c2", "c3"),
    rows=np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 1.0, -1.0, 0.0], [0.0, 0.0, 1.0, -1.0]]),
    capacity=_capacity,
    knots=(0.0, 0.4, 0.9, 1.25, 1.5),
    peak=1.1,
    rest=lambda _t, v, _z: [v[0]],
    start=((10.0, 0.0, 0.0, 0.0), (0.0,)),
)


def solution(time: Array) -> Solution:
    """Speeds of all masses and the angle of the first at `time` (n,) [s]."""
    speeds = {("speed", f"w{i + 1}"): speed(*row) for i, row in enumerate(np.eye(4))}
    return solve(SYSTEM, time, {**speeds, ("angle", "w1"): state(0)})
