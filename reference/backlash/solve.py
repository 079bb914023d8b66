# SPDX-License-Identifier: MIT
"""SciPy solution, from the equations in the README of this folder."""

from __future__ import annotations

import math

import numpy as np

from reference.march import Array, March
from reference.tables import Solution, Table

STIFFNESS, DAMPING, HALF_GAP, INERTIA = 20e3, 50.0, math.pi / 8, 5.0

SHORT_STEP = 5e-5
"""Longest step [s]; the corners of one contact follow each other within 0.2 ms."""


def _play(twist: float, speed: float) -> float:
    """Torque of the shaft with play: a spring-damper that pushes only, damping at most as spring."""
    side = math.copysign(1.0, twist)
    elastic = STIFFNESS * (abs(twist) - HALF_GAP)
    viscous = DAMPING * speed * side
    if elastic <= 0.0 or elastic + viscous <= 0.0:
        return 0.0
    return side * (elastic + min(elastic, viscous))


def _rate(_t: float, x: Array) -> Array:
    loose, play, tight, shaft = x
    torque = STIFFNESS * shaft + DAMPING * tight
    return np.array([-_play(play, loose) / INERTIA, loose, -torque / INERTIA, tight])


def _corner(share: float, x: Array) -> float:
    """Zero where the torque has a corner: elastic torque against a share of the viscous one."""
    elastic = STIFFNESS * (abs(x[1]) - HALF_GAP)
    return float(elastic + share * DAMPING * x[0] * math.copysign(1.0, x[1]))


def solution(time: Array) -> Solution:
    """Speeds, twists and torque at `time` (n,) [s]."""
    march = March([0.0, math.pi / 2, 0.0, math.pi / 2], time, SHORT_STEP)
    kinks = [lambda _t, x, share=share: _corner(share, x) for share in (0.0, 1.0, -1.0)]
    march.advance(_rate, 1.0, [], lambda _t, x: (*x, _play(x[1], x[0])), kinks)
    loose, play, tight, shaft, torque = march.columns()
    columns = {
        ("speed", "loose"): loose,
        ("twist", "play"): play,
        ("speed", "tight"): tight,
        ("twist", "shaft"): shaft,
        ("shaft_torque", "play"): torque,
    }
    return Solution(Table(time, columns), ())
