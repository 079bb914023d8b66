# SPDX-License-Identifier: MIT
"""Friction that depends on the pressure of the plates."""

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
    """Let μ rise with the pressure above P0, less the mean over the slipping phase."""
    found = []
    for one in at.part.structure.elements:
        contact = at.evaluate_contact(one.name)
        slips = contact.per_mu != 0.0
        if not has_free_law(at.point, one.name) or not np.any(slips):
            continue
        share = contact.above / float(np.max(contact.above[slips]))
        relative = std * (share - float(np.mean(share[slips])))
        found.append(build_friction_disturbance(one.name, contact, relative))
    return found


EFFECT = Effect(
    EffectId.FRICTION_PRESSURE,
    "friction that depends on pressure",
    "of μ over the range of pressure",
    0.03,
    "typical range of paper linings: μ falls by 2 to 5 % per MPa; see Mäki, Wet Clutch Tribology, "
    "2005, on friction over pressure",
    "check P0 of the element on the card, which acts alike; record shifts at two pressure levels",
    build,
)
