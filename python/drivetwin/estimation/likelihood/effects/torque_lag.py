# SPDX-License-Identifier: MIT
"""First-order lag of the engine torque, beside its delay."""

from __future__ import annotations

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.data.shift_record import TORQUE
from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint
from drivetwin.vehicle.effects import EffectId

STEP_S = 5e-3
"""Raster [s] on which the curvature of the torque is formed."""
WIDTHS = (9, 7)
"""Points of the moving means in turn: they keep lags of 10 ms and remove noise."""


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Change the acting torque as a filter of time constant `std` does beyond a pure delay.

    A measured torque that lags by τ acts as T + τ·T'. With the delay τ, which is an unknown of
    its own, T(t + τ) = T + τ·T' + τ²/2·T'' remains: the difference is -τ²/2·T''.
    """
    if at.record.of_speeds is not None:
        return []
    steady = at.record.steady_torque
    raster = np.arange(steady.time[0], steady.time[-1], STEP_S)
    if raster.size < sum(WIDTHS):
        return []
    smooth = np.interp(raster, steady.time, steady.values)
    for width in WIDTHS:
        smooth = _average(smooth, width)
    curvature = np.gradient(np.gradient(smooth, raster), raster)
    age = at.part.structure.get_value(at.point, "te_delay")
    change = -0.5 * std**2 * np.interp(at.middle + age, raster, curvature)
    return [Disturbance(inputs={TORQUE: change})]


def _average(values: FloatArray, width: int) -> FloatArray:
    """Average (n,) over an odd number of points, with the ends held."""
    padded = np.pad(values, width // 2, mode="edge")
    return np.convolve(padded, np.ones(width) / width, "valid")


EFFECT = Effect(
    EffectId.TORQUE_LAG,
    "a lag of the engine torque beside its delay",
    "s",
    0.02,
    "typical range of filters by which engine controllers send their torque, 10 to 30 ms",
    "record the engine torque unfiltered, or at a faster rate",
    build,
    power=2.0,
)
