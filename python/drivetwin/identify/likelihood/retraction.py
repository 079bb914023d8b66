# SPDX-License-Identifier: MIT
"""How far steps of the search go along friction laws.

The four coefficients of a Stribeck law nearly compensate each other where v_s is as large as the
slips that occur, and the valley of Q then bends: straight steps in the coefficients crawl along it.
The law's values at three slips with ln v_s as the fourth coordinate say the same, and in them the
valley is straight. A step is therefore taken in these.
"""

from __future__ import annotations

import numpy as np

from drivetwin.identify.friction import stribeck
from drivetwin.identify.likelihood.unknowns import LAW, Point
from drivetwin.identify.signals import FloatArray

SLIPS = np.array([2.0, 25.0, 80.0])
"""Slips [rad/s] at which the law is held to its step: near lock-up, in the middle, at the start."""


def ahead(point: Point, step: FloatArray) -> FloatArray:
    """Values (p,) after a `step` (p,), which the laws take in their values and ln v_s."""
    values = point.values + step
    for name in point.names:
        element, _, key = name.rpartition(".")
        if key != LAW[-1]:
            continue
        index = [point.names.index(f"{element}.{one}") for one in LAW]
        mu, slopes = stribeck(point.values[index], SLIPS)
        told = mu + slopes.T @ step[index]
        _, linear = stribeck(values[index], SLIPS)
        values[index[:-1]] = np.linalg.solve(linear[:-1].T, told)
    return values
