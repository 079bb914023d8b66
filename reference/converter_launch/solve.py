# SPDX-License-Identifier: MIT
"""SciPy solution, from the equations in the README of this folder."""

from __future__ import annotations

import numpy as np

from reference.march import Array
from reference.mechanism import Mechanism, solve, speed, state
from reference.tables import Solution

RATIO, LAG, AERO, ROLLING = 15.0, 0.2, 0.9, 700.0
THROTTLES, SPEEDS = (0.0, 0.4, 1.0), (60.0, 120.0, 180.0, 240.0)
TORQUES = (
    (40.0, -60.0, -120.0, -180.0),
    (500.0, 620.0, 540.0, 300.0),
    (900.0, 1250.0, 1150.0, 800.0),
)
NU, CAPACITY = (0.0, 0.5, 0.85, 1.0, 1.3), (0.036, 0.031, 0.020, 0.0, -0.012)
TORQUE_RATIO = (1.9, 1.4, 1.0, 1.0, 1.0)
SLIP, MU, GAIN, P_0 = (0.0, 20.0, 100.0), (0.12, 0.105, 0.11), 0.02, 1e5
PEDAL_TIMES, PEDAL = (0.0, 0.2, 0.8, 4.8, 5.0, 6.0), (0.0, 0.0, 0.7, 0.7, 0.0, 0.0)
PEDAL_CORNERS = (0.2 + 0.6 * 0.4 / 0.7, 4.8 + 0.2 * 0.3 / 0.7)
SYNCHRONOUS = 1.0
"""Speed ratio that is passed, in this problem, only as the lock-up clutch locks."""
FILL_ENDS = 2.5 + 0.8 * P_0 / 8e5


def _target(t: float, engine: float) -> float:
    rows = [float(np.interp(engine, SPEEDS, row)) for row in TORQUES]
    return float(np.interp(np.interp(t, PEDAL_TIMES, PEDAL), THROTTLES, rows))


def _pump(v: Array) -> tuple[float, float]:
    """Torque that the pump takes and that the turbine gives."""
    ratio = RATIO * v[1] / v[0]
    taken = float(np.interp(ratio, NU, CAPACITY)) * v[0] ** 2
    return taken, float(np.interp(ratio, NU, TORQUE_RATIO)) * taken


def _force(_t: float, v: Array, z: Array) -> list[float]:
    taken, given = _pump(v)
    return [z[0] - taken, RATIO * given - AERO * v[1] * abs(v[1])]


def _capacity(t: float, slip: Array) -> list[float]:
    pressure = float(np.interp(t, (0.0, 2.5, 3.3, 6.0), (0.0, 0.0, 8e5, 8e5)))
    return [float(np.interp(slip[0], SLIP, MU)) * GAIN * max(0.0, pressure - P_0), ROLLING]


def _kinks(_t: float, v: Array, _z: Array) -> list[float]:
    borders = [v[0] - border for border in SPEEDS]
    ratios = [RATIO * v[1] - border * v[0] for border in NU[1:] if border != SYNCHRONOUS]
    slips = [v[0] - RATIO * v[1] - slip for slip in SLIP[1:]]
    return [*borders, *ratios, *slips]


SYSTEM = Mechanism(
    mass=np.diag([3.0, 2500.0 + 0.4 * RATIO**2]),
    force=_force,
    elements=("lock-up", "load"),
    rows=np.array([[1.0, -RATIO], [0.0, 1.0]]),
    capacity=_capacity,
    knots=tuple(sorted({*PEDAL_TIMES, *PEDAL_CORNERS, 2.5, FILL_ENDS, 3.3})),
    rest=lambda t, v, z: [(_target(t, v[0]) - z[0]) / LAG, v[1]],
    kinks=_kinks,
    start=((70.0, 0.0), (0.0, 0.0)),
)


def solution(time: Array) -> Solution:
    """Speeds of engine and turbine and the angle of the axle at `time` (n,) [s]."""
    outputs = {
        ("speed", "engine"): speed(1.0, 0.0),
        ("speed", "turbine"): speed(0.0, RATIO),
        ("angle", "axle"): state(1),
    }
    return solve(SYSTEM, time, outputs)
