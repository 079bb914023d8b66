# SPDX-License-Identifier: MIT
"""Residual brake torque at the wheel that fades within a shift."""

from __future__ import annotations

from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint, compute_middle
from drivetwin.vehicle.effects import EffectId


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Let a brake torque at the wheel fall linearly to zero over the record of the shift.

    A constant drag is part of the constant load, which is an unknown of the fit.
    """
    torque = std * at.load * at.model.i_f * (1.0 - compute_middle(at.progress))
    return [Disturbance(at.describe_shift(), force=at.build_force(2, -torque))]


EFFECT = Effect(
    EffectId.BRAKE_DRAG,
    "a residual brake torque that fades",
    "of the load, at the start of the shift's record",
    0.005,
    "engineering estimate: released pads keep of the order of a hundredth of the load, half of "
    "which fades within a record",
    "record without braking before the shift, and check that the brakes release",
    build,
)
