# SPDX-License-Identifier: MIT
"""SciPy solution, from the equations in the README of this folder."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from reference.march import Array, Gap, March
from reference.tables import Solution, Table

STIFFNESS, DAMPING, HALF_GAP, INERTIA = 20e3, 50.0, math.pi / 8, 5.0
END = 1.0
SHORT_STEP = 1e-4
"""Longest step [s]; the branches of one contact follow each other within 0.2 ms."""

Branch = Literal["free", "damping cut", "full"]


def _torques(x: Array) -> tuple[float, float, float]:
    """Side of the contact, spring torque and damping torque towards it."""
    side = math.copysign(1.0, x[1])
    return side, STIFFNESS * (abs(x[1]) - HALF_GAP), DAMPING * x[0] * side


def _play(branch: Branch, x: Array) -> float:
    """Torque of the shaft with play in one branch of its law."""
    side, elastic, viscous = _torques(x)
    if branch == "free":
        return 0.0
    return side * (elastic + (elastic if branch == "damping cut" else viscous))


def _ends(branch: Branch) -> list[tuple[Gap, Branch]]:
    """What ends a branch, and what follows."""

    def compression(_t: float, x: Array) -> float:
        return -_torques(x)[1]

    def excess(_t: float, x: Array) -> float:
        _, elastic, viscous = _torques(x)
        return viscous - elastic

    def pressure(_t: float, x: Array) -> float:
        _, elastic, viscous = _torques(x)
        return elastic + viscous

    match branch:
        case "free":
            return [(compression, "damping cut")]
        case "damping cut":
            return [(excess, "full")]
        case "full":
            return [(pressure, "free")]


def solution(time: Array) -> Solution:
    """Speeds, twists and torque at `time` (n,) [s]."""
    march = March([0.0, math.pi / 2, 0.0, math.pi / 2], time, SHORT_STEP)
    branch: Branch = "full"
    fired: int | None = 0
    while fired is not None:
        now = branch
        ends = _ends(now)

        def rate(_t: float, x: Array, now: Branch = now) -> Array:
            torque = STIFFNESS * x[3] + DAMPING * x[2]
            return np.array([-_play(now, x) / INERTIA, x[0], -torque / INERTIA, x[2]])

        def observe(_t: float, x: Array, now: Branch = now) -> tuple[float, ...]:
            return (*x, _play(now, x))

        fired = march.advance(rate, END, [gap for gap, _ in ends], observe)
        branch = ends[fired or 0][1]
    loose, play, tight, shaft, torque = march.columns()
    columns = {
        ("speed", "loose"): loose,
        ("twist", "play"): play,
        ("speed", "tight"): tight,
        ("twist", "shaft"): shaft,
        ("shaft_torque", "play"): torque,
    }
    return Solution(Table(time, columns), ())
