# SPDX-License-Identifier: MIT
"""Shaft stiffness that rises with the twist."""

from __future__ import annotations

from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint
from drivetwin.estimation.likelihood.effects.shaft_torque import build_shaft_disturbance
from drivetwin.vehicle.effects import EffectId


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Add a cubic term to the torque over the twist, less half of it at the largest torque."""
    linear = at.model.k_o * at.run.twist
    cubic = linear * ((linear / at.largest_shaft_torque) ** 2 - 0.5)
    return [build_shaft_disturbance(at, std * cubic)]


EFFECT = Effect(
    EffectId.PROGRESSIVE_SHAFT,
    "a shaft that stiffens with its twist",
    "of the stiffness at the largest shaft torque",
    0.015,
    "engineering estimate: joints, splines and tyres in series with a steel shaft make a "
    "characteristic progressive by 1 to 3 %",
    "compare shifts at two torque levels",
    build,
)
