# SPDX-License-Identifier: MIT
"""SciPy solution, from the equations in the README of this folder."""

from __future__ import annotations

import math

import numpy as np

from reference.march import Array, March
from reference.tables import Solution, Table


def _rate(t: float, x: Array) -> Array:
    speed2, speed3, angle2, angle3 = x
    shaft = 1e4 * (angle2 - angle3)
    drive = 10.0 * 10.0 * math.sin(10.0 * math.pi * t)
    return np.array([(drive - 10.0 * speed2 - shaft) / 12.0, shaft / 2.0, speed2, speed3])


def solution(time: Array) -> Solution:
    """Speeds, angles and shaft torque at `time` (n,) [s]."""
    march = March([0.0, 0.0, 0.0, 0.0], time)
    march.advance(_rate, 1.0, [], lambda _t, x: (*x, 1e4 * (x[2] - x[3])))
    speed2, speed3, angle2, angle3, shaft = march.columns()
    columns = {
        ("speed", "end"): speed3,
        ("angle", "end"): angle3,
        ("speed", "middle"): speed2,
        ("angle", "middle"): angle2,
        ("shaft_torque", "shaft"): shaft,
    }
    return Solution(Table(time, columns), ())
