# SPDX-License-Identifier: MIT
"""Drag torque at the gearbox input, constant and growing with speed."""

from __future__ import annotations

import numpy as np

from drivetwin.estimation.likelihood.data.shift_record import TORQUE
from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint, compute_middle
from drivetwin.vehicle.effects import EffectId


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Subtract the drag from the torque through the gears; an offset of the engine torque is the
    same."""
    size = std * at.largest_engine_torque
    speed = compute_middle(at.run.engine_speed) / float(np.mean(at.run.engine_speed))
    shapes = (np.ones_like(speed), speed - 1.0)
    return [Disturbance(inputs={TORQUE: -size * shape}) for shape in shapes]


EFFECT = Effect(
    EffectId.INPUT_DRAG,
    "drag at the gearbox input, or an offset of the engine torque",
    "of the largest engine torque",
    0.005,
    "typical range of open wet clutches and pump, 0.3 to 1 % of the rated torque; see Kitabayashi "
    "et al., SAE 2003-01-1973, on drag of wet clutches",
    "calibrate the engine torque at zero load, or state the drag under [effects]",
    build,
)
