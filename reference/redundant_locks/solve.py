# SPDX-License-Identifier: MIT
"""SciPy solution, from the equations in the README of this folder."""

from __future__ import annotations

import numpy as np

from reference.march import Array, March
from reference.tables import Change, Solution, Table

STRONG, WEAK, PEAK, INERTIA = 100.0, 40.0, 1.2, 2.0
KNOTS, TORQUES = (0.0, 1.0, 1.5, 2.0), (0.0, 180.0, 60.0, 155.0)


def _torque(t: float) -> float:
    return float(np.interp(t, KNOTS, TORQUES))


def _held(t: float) -> tuple[float, float]:
    """Split of the torque that the resting shaft needs, which is not negative in this problem.

    Least sum of squared utilisations: proportional to the squared capacities, until the stronger
    brake is at its limit.
    """
    need = _torque(t)
    strong = min(need * STRONG**2 / (STRONG**2 + WEAK**2), PEAK * STRONG)
    return strong, need - strong


def _rate(slips: bool, t: float, x: Array) -> Array:
    return np.array([(_torque(t) - STRONG - WEAK) / INERTIA if slips else 0.0, x[0]])


def solution(time: Array) -> Solution:
    """Speed, angle and both brake torques at `time` (n,) [s]."""
    march = March([0.0, 0.0], time)
    changes: list[Change] = []
    slips = False
    for end in KNOTS[1:]:
        fired: int | None = 0
        while fired is not None:

            def observe(t: float, x: Array, slips: bool = slips) -> tuple[float, ...]:
                return (*x, *((STRONG, WEAK) if slips else _held(t)))

            def rate(t: float, x: Array, slips: bool = slips) -> Array:
                return _rate(slips, t, x)

            def gap(t: float, x: Array, slips: bool = slips) -> float:
                return float(x[0]) if slips else PEAK * (STRONG + WEAK) - _torque(t)

            fired = march.advance(rate, end, [gap], observe)
            if fired is not None:
                slips = not slips
                kind = "break_away" if slips else "lock"
                changes += [Change(march.t, name, kind) for name in ("strong", "weak")]
    names = (
        ("speed", "shaft"),
        ("angle", "shaft"),
        ("friction_torque", "strong"),
        ("friction_torque", "weak"),
    )
    columns = dict(zip(names, march.columns(), strict=True))
    return Solution(Table(time, columns), tuple(changes))
