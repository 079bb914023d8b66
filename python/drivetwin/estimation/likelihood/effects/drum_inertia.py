# SPDX-License-Identifier: MIT
"""Inertia of a clutch drum that the card does not state."""

from __future__ import annotations

from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint
from drivetwin.estimation.likelihood.noise.shift_response import build_slip_row
from drivetwin.vehicle.effects import EffectId

REFERENCE_TORQUE = 1500.0
"""Engine torque [N m] to which the prior refers: drums grow with the torque that they carry."""


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Add the torque of an inertia that rotates with the slip of each element without a drum."""
    size = std * at.largest_engine_torque / REFERENCE_TORQUE
    stated = {one.name for one in at.part.structure.driveline.drums}
    found = []
    for one in at.model.elements:
        if one.name in stated:
            continue
        torque = size * at.compute_rate(at.run.slip[one.name])
        force = -torque[:, None] * build_slip_row(at.model, one)
        found.append(Disturbance(one.name, force))
    return found


EFFECT = Effect(
    EffectId.DRUM_INERTIA,
    "a drum inertia that the card does not state",
    "kg m² per 1500 N m of engine torque",
    0.03,
    "engineering estimate for heavy-duty boxes of 1500 N m: drums of 5 to 10 kg at a radius of "
    "0.08 m",
    "state drum_inertia_kgm2 of the element on the card",
    build,
)
