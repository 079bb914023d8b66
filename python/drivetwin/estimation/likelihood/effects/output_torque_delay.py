# SPDX-License-Identifier: MIT
"""Output torque that is measured late or early against the speeds."""

from __future__ import annotations

import numpy as np

from drivetwin.estimation.likelihood.data.shift_record import OUTPUT_TORQUE
from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint
from drivetwin.vehicle.effects import EffectId


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Delay the simulated output torque; the speeds are the reference clock."""
    time, torque = at.run.time, at.run.shaft_torque
    return [Disturbance(outputs={OUTPUT_TORQUE: np.interp(time - std, time, torque) - torque})]


EFFECT = Effect(
    EffectId.OUTPUT_TORQUE_DELAY,
    "a delay of the output torque against the speeds",
    "s",
    0.003,
    "typical range of anti-aliasing filters and telemetry of torque sensors, 1 to 5 ms",
    "set channels.output_torque.time_shift_s in the channel mapping and compare",
    build,
    curved=True,
    signed=True,
    negative="negative: the output torque is early",
)
