# SPDX-License-Identifier: MIT
"""Backlash of the driveline behind the output torque."""

from __future__ import annotations

import numpy as np

from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint
from drivetwin.estimation.likelihood.effects.shaft_torque import build_shaft_disturbance
from drivetwin.vehicle.effects import EffectId

ROUNDING = 0.03
"""Share of the largest torque over which the sign is rounded: a sensor's noise about zero."""
REVERSED = 0.5
"""Change of the rounded sign from which the torque counts as reversed."""


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Shift the characteristic of the shaft by half the gap to the side of its torque.

    Half a gap Δ with T = k_o·(φ - Δ·sign T) changes the torque at a given twist by -k_o·Δ·sign T.
    Nothing where the torque keeps its sign: the gap is then part of the initial twist.
    """
    largest = at.largest_shaft_torque
    sign = np.tanh(at.run.shaft_torque / (ROUNDING * largest))
    if np.ptp(sign) <= REVERSED:
        return []
    return [build_shaft_disturbance(at, -std * largest * (sign - sign[0]))]


EFFECT = Effect(
    EffectId.BACKLASH,
    "backlash in the driveline",
    "half gap times stiffness, of the largest shaft torque",
    0.03,
    "typical range of 1 to 3 degrees at the wheel, less what the preload takes; see Lagerberg and "
    "Egardt, IEEE Trans. CST 15, 2007, on backlash of powertrains",
    "use shifts in which the shaft torque keeps its sign",
    build,
)
