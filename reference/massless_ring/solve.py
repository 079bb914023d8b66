# SPDX-License-Identifier: MIT
"""SciPy solution, from the equations in the README of this folder."""

from __future__ import annotations

import numpy as np

from reference.march import Array
from reference.mechanism import Mechanism, solve, speed, state
from reference.tables import Solution

Z = 2.2
RING = np.array([-1.0 / Z, (1.0 + Z) / Z])
GAIN, P_0 = 2e-3, 5e4
FILL_ENDS = 0.1 + 0.3 * (P_0 - 4e4) / (25e4 - 4e4)


def _force(t: float, v: Array, _z: Array) -> list[float]:
    if t < 0.6:
        drive = 10.0
    else:
        drive = float(np.interp(t, (0.6, 0.9, 1.2, 1.6, 2.0), (40.0, 40.0, 8.0, -25.0, 5.0)))
    return [drive, -12.0 - 0.03 * v[1] * abs(v[1])]


def _capacity(t: float, slip: Array) -> list[float]:
    pressure = float(np.interp(t, (0.0, 0.1, 0.4, 2.0), (0.0, 4e4, 25e4, 25e4)))
    mu = 0.10 + 0.03 * np.exp(-slip[0] / 8.0) + 2e-4 * slip[0]
    return [float(mu) * GAIN * max(0.0, pressure - P_0)]


SYSTEM = Mechanism(
    mass=np.diag([0.05, 2.0]),
    force=_force,
    elements=("brake",),
    rows=np.array([RING]),
    capacity=_capacity,
    knots=(0.0, 0.1, FILL_ENDS, 0.4, 0.6, 0.9, 1.2, 1.6, 2.0),
    peak=1.15,
    rest=lambda _t, v, _z: [v[1]],
    kinks=lambda _t, v, _z: [v[1]],
    start=((30.0, 20.0), (0.0,)),
)


def solution(time: Array) -> Solution:
    """Speeds of the three members and the angle of the carrier at `time` (n,) [s]."""
    outputs = {
        ("speed", "sun"): speed(1.0, 0.0),
        ("speed", "ring"): speed(*RING),
        ("speed", "carrier"): speed(0.0, 1.0),
        ("angle", "carrier"): state(0),
    }
    return solve(SYSTEM, time, outputs)
