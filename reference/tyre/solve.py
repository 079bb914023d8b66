# SPDX-License-Identifier: MIT
"""SciPy solution, from the equations in the README of this folder."""

from __future__ import annotations

import numpy as np

from reference.march import Array, Gap, March
from reference.tables import Solution, Table

TIMES, TORQUES = (0.0, 0.6, 0.7, 4.5), (150.0, 150.0, -200.0, -200.0)
TWISTS = (-0.2, -0.05, 0.0, 0.05, 0.2)
SPRING = (-500.0, -60.0, 0.0, 50.0, 350.0)
DAMPING, SLIP_STIFFNESS, LEAST_SPEED, AERO = 2.0, 3000.0, 4.0, 0.05


def _compute_shaft_torque(x: Array) -> float:
    motor, wheel, _, twist = x
    piece = int(np.clip(np.searchsorted(TWISTS, twist) - 1, 0, len(TWISTS) - 2))
    slope = (SPRING[piece + 1] - SPRING[piece]) / (TWISTS[piece + 1] - TWISTS[piece])
    elastic = SPRING[piece] + slope * (twist - TWISTS[piece])
    return float(elastic + DAMPING * (motor - wheel))


def _rate(t: float, x: Array) -> Array:
    motor, wheel, vehicle, _ = x
    shaft = _compute_shaft_torque(x)
    tyre = SLIP_STIFFNESS * (wheel - vehicle) / max(abs(vehicle), LEAST_SPEED)
    drive = float(np.interp(t, TIMES, TORQUES))
    drag = AERO * vehicle * abs(vehicle)
    return np.array(
        [(drive - shaft) / 0.5, (shaft - tyre) / 2.0, (tyre - drag) / 40.0, motor - wheel]
    )


def _place(index: int, value: float) -> Gap:
    return lambda _t, x: float(x[index]) - value


def solution(time: Array) -> Solution:
    """Speeds, twist and torque at `time` (n,) [s]."""
    march = March([10.0, 10.0, 10.0, 0.0], time)
    # A twist of -0.2 or 0.2 rad only ends the table, whose last pieces go on.
    kinks = [_place(3, twist) for twist in TWISTS[1:-1]]
    kinks += [_place(2, speed) for speed in (-LEAST_SPEED, 0.0, LEAST_SPEED)]
    for end in TIMES[1:]:
        march.advance(_rate, end, [], lambda _t, x: (*x, _compute_shaft_torque(x)), kinks)
    motor, wheel, vehicle, twist, torque = march.columns()
    columns = {
        ("speed", "motor"): motor,
        ("speed", "wheel"): wheel,
        ("speed", "vehicle"): vehicle,
        ("twist", "shaft"): twist,
        ("shaft_torque", "shaft"): torque,
    }
    return Solution(Table(time, columns), ())
