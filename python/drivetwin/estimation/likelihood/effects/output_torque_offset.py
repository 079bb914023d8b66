# SPDX-License-Identifier: MIT
"""Constant error of the output torque sensor."""

from __future__ import annotations

import numpy as np

from drivetwin.estimation.likelihood.data.shift_record import OUTPUT_TORQUE
from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint
from drivetwin.vehicle.effects import EffectId


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Add a constant to the output torque."""
    offset = np.full(at.run.time.size, std * at.largest_shaft_torque)
    return [Disturbance(outputs={OUTPUT_TORQUE: offset})]


EFFECT = Effect(
    EffectId.OUTPUT_TORQUE_OFFSET,
    "an offset of the output torque",
    "of the largest shaft torque",
    0.001,
    "typical range of the zero error of torque flanges and telemetry, 0.1 to 0.3 % of full scale",
    "zero the output torque sensor with the driveline unloaded",
    build,
)
