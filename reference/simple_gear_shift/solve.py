# SPDX-License-Identifier: MIT
"""SciPy solution, from the equations in the README of this folder."""

from __future__ import annotations

import numpy as np

from reference.march import Array
from reference.mechanism import Mechanism, solve, speed, state
from reference.tables import Solution

Z = 1.5
RING = np.array([-1.0 / Z, (1.0 + Z) / Z])
NOMINAL_SPEED = 10.471975511966


def _force(t: float, v: Array, _z: Array) -> list[float]:
    load = 20.0 * v[1] * abs(v[1]) / NOMINAL_SPEED**2
    return [20.0 if t >= 0.5 else 0.0, -load]


def _capacity(t: float, _slip: Array) -> list[float]:
    share = min(max((t - 2.0) / 0.1, 0.0), 1.0)
    return [100.0 * share, 100.0 * (1.0 - share)]


SYSTEM = Mechanism(
    mass=np.diag([1.0, 10.0]),
    force=_force,
    elements=("clutch", "brake"),
    rows=np.array([np.array([1.0, 0.0]) - RING, RING]),
    capacity=_capacity,
    knots=(0.0, 0.5, 2.0, 2.1, 5.0),
    rest=lambda _t, v, _z: [v[0]],
    start=((0.0, 0.0), (0.0,)),
)


def solution(time: Array) -> Solution:
    """Speeds of the three members and the angle of the sun at `time` (n,) [s]."""
    outputs = {
        ("speed", "sun"): speed(1.0, 0.0),
        ("speed", "carrier"): speed(0.0, 1.0),
        ("speed", "ring"): speed(*RING),
        ("angle", "sun"): state(0),
    }
    return solve(SYSTEM, time, outputs)
