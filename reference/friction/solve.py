# SPDX-License-Identifier: MIT
"""SciPy solution, from the equations in the README of this folder."""

from __future__ import annotations

import math

import numpy as np

from reference.march import Array
from reference.mechanism import Mechanism, solve, speed, state
from reference.tables import Solution


def _force(t: float, v: Array, z: Array) -> list[float]:
    shaft = 160.0 * z[0] + 1.0 * (v[1] - v[2])
    return [200.0 * math.sin(100.0 * t) if t < 0.5 else 0.0, -shaft, shaft]


SYSTEM = Mechanism(
    mass=np.diag([1.0, 0.05, 1.0]),
    force=_force,
    elements=("clutch", "brake"),
    rows=np.array([[1.0, -1.0, 0.0], [0.0, 0.0, 1.0]]),
    capacity=lambda t, _slip: [80.0, 800.0 if t >= 0.5 else 0.0],
    knots=(0.0, 0.5, 3.0),
    rest=lambda _t, v, _z: [v[1] - v[2]],
    start=((100.0, 90.0, 90.0), (0.0,)),
)


def solution(time: Array) -> Solution:
    """Speeds and the twist of the shaft at `time` (n,) [s]."""
    outputs = {
        ("speed", "motor"): speed(1.0, 0.0, 0.0),
        ("speed", "middle"): speed(0.0, 1.0, 0.0),
        ("speed", "end"): speed(0.0, 0.0, 1.0),
        ("twist", "shaft"): state(0),
    }
    return solve(SYSTEM, time, outputs)
