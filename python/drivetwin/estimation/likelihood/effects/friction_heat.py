# SPDX-License-Identifier: MIT
"""Friction that falls as the plates heat up within a shift."""

from __future__ import annotations

import numpy as np

from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.friction_shape import (
    build_friction_disturbance,
    has_free_law,
)
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint
from drivetwin.vehicle.effects import EffectId


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Let μ fall with the friction work done, as a share of that of the whole shift."""
    found = []
    for one in at.part.structure.elements:
        if not has_free_law(at.point, one.name):
            continue
        contact = at.evaluate_contact(one.name)
        torque = contact.per_mu * contact.friction
        work = np.cumsum(np.abs(contact.slip * torque) * np.diff(at.run.time))
        if work[-1] > 0.0:
            found.append(build_friction_disturbance(one.name, contact, -std * work / work[-1]))
    return found


EFFECT = Effect(
    EffectId.FRICTION_HEAT,
    "friction that falls with the friction work",
    "of μ over the work of the shift",
    0.03,
    "typical range of paper linings: μ falls by 3 to 10 % per 100 K, a shift heats the surface by "
    "30 to 60 K; see Mäki, Wet Clutch Tribology, 2005, on friction over temperature",
    "record shifts that differ in friction work",
    build,
)
