# SPDX-License-Identifier: MIT
"""SciPy solution, from the equations in the README of this folder."""

from __future__ import annotations

from reference.lossy_gear.solve import solve
from reference.march import Array
from reference.tables import Solution


def solution(time: Array) -> Solution:
    """Speeds and angle at `time` (n,) [s]."""
    return solve(time, "bearing", lambda speed: 0.5 + 0.5 * speed)
