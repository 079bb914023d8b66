# SPDX-License-Identifier: MIT
"""Load that grows with the square of the speed."""

from __future__ import annotations

from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint, compute_middle
from drivetwin.estimation.linear.load_balance import AERO
from drivetwin.vehicle.effects import EffectId


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Let a share of the load grow with the square of the wheel speed, held at the mean speed.

    Nothing where the fit has this part of the load as an unknown.
    """
    if AERO in at.point.names:
        return []
    square = compute_middle(at.run.wheel_speed) ** 2
    growth = square / max(at.part.structure.mean_speed**2, 1e-9) - 1.0
    torque = std * at.load * at.model.i_f * growth
    return [Disturbance(force=at.build_force(2, -torque))]


EFFECT = Effect(
    EffectId.AERO_LOAD,
    "a load that grows with the square of the speed",
    "of the load",
    0.1,
    "typical share of air drag in the road load of a truck below 40 km/h, about a tenth; see "
    "Mitschke and Wallentowitz, Dynamik der Kraftfahrzeuge, on driving resistances",
    "record a longer stretch in gear, or a coast-down from a higher speed",
    build,
)
