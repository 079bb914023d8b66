# SPDX-License-Identifier: MIT
"""SciPy solution, from the equations in the README of this folder."""

from __future__ import annotations

import math

import numpy as np

from reference.march import Array
from reference.mechanism import Mechanism, solve, speed, state
from reference.tables import Solution

SYSTEM = Mechanism(
    mass=np.eye(2),
    force=lambda t, _v, _z: [10.0 * math.sin(6.0 * math.pi * t), 0.0],
    elements=("freewheel",),
    rows=np.array([[1.0, -1.0]]),
    capacity=lambda t, _slip: [1.5 if 0.3 <= t < 0.95 or t >= 1.6 else 0.0],
    knots=(0.0, 0.3, 0.95, 1.6, 2.0),
    peak=25.0,
    one_way=("freewheel",),
    rest=lambda _t, v, _z: [v[0], v[1]],
    start=((-0.5, 0.0), (0.0, 0.0)),
)


def solution(time: Array) -> Solution:
    """Speeds and angles at `time` (n,) [s]."""
    outputs = {
        ("speed", "in"): speed(1.0, 0.0),
        ("speed", "out"): speed(0.0, 1.0),
        ("angle", "in"): state(0),
        ("angle", "out"): state(1),
    }
    return solve(SYSTEM, time, outputs)
