# SPDX-License-Identifier: MIT
"""SciPy solution, from the equations in the README of this folder."""

from __future__ import annotations

from reference.dual_clutch_upshift.solve import OUTPUTS, Line, driveline
from reference.march import Array
from reference.mechanism import solve
from reference.tables import Solution


def solution(time: Array) -> Solution:
    """Speeds, twist and shaft torque at `time` (n,) [s]."""
    engine = Line((0.0, 1.6), (1545.0, 1545.0))
    b2 = Line((0.0, 1.0, 1.2, 1.6), (14e5, 14e5, 0.0, 0.0))
    b3 = Line((0.0, 0.2, 0.6, 1.6), (0.0, 0.0, 14e5, 14e5))
    return solve(driveline(engine, (b2, b3)), time, OUTPUTS)
