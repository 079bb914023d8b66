# SPDX-License-Identifier: MIT
"""Pressure that is measured late or early against the torque that it makes."""

from __future__ import annotations

import numpy as np

from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.estimation.likelihood.data.input_smoothing import smooth_adaptive
from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint
from drivetwin.vehicle.effects import EffectId


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Delay the pressure of each element, by the rate of the pressure without noise."""
    found = []
    for name, signal in at.record.pressures.items():
        sigma = at.record.input_sigma[name]
        steady = smooth_adaptive(MeasuredSignal(signal.time, signal.values, sigma))
        rate = at.compute_rate(np.interp(at.run.time, signal.time, steady))
        found.append(Disturbance(name, inputs={name: -std * rate}))
    return found


EFFECT = Effect(
    EffectId.PRESSURE_DELAY,
    "a clutch pressure that acts later than it is measured",
    "s",
    0.003,
    "typical range of lines between sensor port and piston and of filters of pressure sensors, 1 "
    "to 5 ms",
    "set time_shift_s of the pressure in the channel mapping and compare",
    build,
    negative="negative: the measured pressure is late",
)
