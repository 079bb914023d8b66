# SPDX-License-Identifier: MIT
"""SciPy solution, from the equations in the README of this folder."""

from __future__ import annotations

import numpy as np

from reference.march import Array, March
from reference.tables import Change, Solution, Table

LOAD, END, STIFFNESS, DAMPING = 0.5, 0.2, 200.0, 1.0
CAPACITY, PEAK = 10.0, 1.2
KNOTS = (0.0, 0.1, 0.6, 1.0, 1.3, 1.6, 2.0)
SPEEDS = (0.0, 0.0, 20.0, 20.0, 0.0, 0.0, -3.0)


class Motion:
    """Load, end and twist while the motor's speed changes at a given rate."""

    def __init__(self, motor_rate: float, mode: int) -> None:
        self.motor_rate = motor_rate
        self.mode = mode

    def clutch(self, x: Array) -> float:
        """Torque on the load: what it takes to follow the motor, or the capacity."""
        shaft = STIFFNESS * x[2] + DAMPING * (x[0] - x[1])
        return float(LOAD * self.motor_rate + shaft) if self.mode == 0 else CAPACITY * self.mode

    def rate(self, _t: float, x: Array) -> Array:
        """Of speeds of load and end, and the twist."""
        shaft = STIFFNESS * x[2] + DAMPING * (x[0] - x[1])
        return np.array([(self.clutch(x) - shaft) / LOAD, shaft / END, x[0] - x[1]])

    def gap(self, t: float, x: Array) -> float:
        """Reserve of the clutch at rest, else the size of its slip."""
        slip = float(np.interp(t, KNOTS, SPEEDS)) - float(x[0])
        return PEAK * CAPACITY - abs(self.clutch(x)) if self.mode == 0 else slip * self.mode


def _mode_from(x: Array, motor_rate: float) -> int:
    """Mode of a clutch without slip."""
    needed = Motion(motor_rate, 0).clutch(x)
    return 0 if abs(needed) <= PEAK * CAPACITY else int(np.sign(needed))


def solution(time: Array) -> Solution:
    """Speeds, twist and the slip of the brake at `time` (n,) [s]."""
    march = March([0.0, 0.0, 0.0], time)
    changes: list[Change] = []
    mode = 0
    for i, end in enumerate(KNOTS[1:]):
        motor_rate = (SPEEDS[i + 1] - SPEEDS[i]) / (end - KNOTS[i])
        if i > 0 and SPEEDS[i] == 0.0:
            kind = "lock" if motor_rate == 0.0 else "break_away"
            changes.append(Change(march.t, "brake", kind))
        if mode == 0:
            mode = _mode_from(march.x, motor_rate)
            if mode != 0:
                changes.append(Change(march.t, "clutch", "break_away"))
        fired: int | None = 0
        while fired is not None:
            motion = Motion(motor_rate, mode)
            fired = march.advance(
                motion.rate,
                end,
                [motion.gap],
                lambda t, x: (*x, float(np.interp(t, KNOTS, SPEEDS))),
            )
            if fired is not None:
                before = mode
                overload = int(np.sign(motion.clutch(march.x)))
                mode = overload if before == 0 else _mode_from(march.x, motor_rate)
                kind = "break_away" if before == 0 else "lock" if mode == 0 else "reverse"
                changes.append(Change(march.t, "clutch", kind))
    load, far, twist, motor = march.columns()
    columns = {
        ("speed", "motor"): motor,
        ("speed", "load"): load,
        ("speed", "end"): far,
        ("twist", "shaft"): twist,
        ("slip", "brake"): motor,
    }
    return Solution(Table(time, columns), tuple(changes))
