# SPDX-License-Identifier: MIT
"""Friction over slip that no Stribeck law has."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint
from drivetwin.estimation.likelihood.parametrization import LAW
from drivetwin.estimation.likelihood.slip_contact import Contact
from drivetwin.estimation.linear.friction_points import evaluate_stribeck
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.vehicle.effects import EffectId

WAVES = 6
"""Shapes of friction over slip: so many half cosines over the root of slip."""
GRID = 200
"""Slips at which shapes are projected onto the Stribeck law."""


@dataclass(frozen=True, eq=False)
class FrictionShapes:
    """Basis functions orthogonal to the Stribeck law `law` (4,), up to the slip `largest`
    [rad/s]: cosines over the root of slip, less their projection onto the slopes of the law."""

    law: FloatArray
    largest: float

    def evaluate(self, slip: FloatArray) -> FloatArray:
        """Evaluate each shape (n, WAVES) at |slip| (n,)."""
        grid = self.largest * np.linspace(0.0, 1.0, GRID) ** 2
        slopes = evaluate_stribeck(self.law, grid)[1].T
        by_law = np.linalg.lstsq(slopes, self._evaluate_waves(grid), rcond=None)[0]
        return np.asarray(
            self._evaluate_waves(slip) - evaluate_stribeck(self.law, slip)[1].T @ by_law
        )

    def _evaluate_waves(self, slip: FloatArray) -> FloatArray:
        place = np.sqrt(np.clip(slip / self.largest, 0.0, 1.0))
        return np.cos(np.pi * np.outer(place, np.arange(1, WAVES + 1)))


def has_free_law(point: ParameterVector, element: str) -> bool:
    """Return whether all coefficients of the friction law of an element are unknowns."""
    return f"{element}.{LAW[-1]}" in point.names


def build_shapes(at: OperatingPoint, element: str) -> FrictionShapes:
    """Build the shapes of an element over the slips at which it transmits torque."""
    contact = at.evaluate_contact(element)
    loaded = np.abs(contact.slip[contact.per_mu != 0.0])
    law = np.array([at.point[f"{element}.{key}"] for key in LAW])
    return FrictionShapes(law, max(float(np.max(loaded, initial=0.0)), 1.0))


def build_friction_disturbance(element: str, contact: Contact, relative: FloatArray) -> Disturbance:
    """Build the action of a `relative` change (N-1,) of μ: the same change of the pressure above
    P0 makes the same torque."""
    slips = contact.per_mu != 0.0
    return Disturbance(element, inputs={element: relative * contact.above * slips})


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Add each shape to the friction of every element whose law is free."""
    found = []
    for one in at.part.structure.elements:
        if not has_free_law(at.point, one.name):
            continue
        contact = at.evaluate_contact(one.name)
        shapes = build_shapes(at, one.name).evaluate(np.abs(contact.slip))
        changes = std * shapes / contact.friction[:, None]
        found += [build_friction_disturbance(one.name, contact, each) for each in changes.T]
    return found


EFFECT = Effect(
    EffectId.FRICTION_SHAPE,
    "friction that departs from a Stribeck law over slip",
    "change of μ per shape",
    0.002,
    "engineering estimate: friction curves of paper linings scatter about a Stribeck law by 1 to "
    "2 % of μ",
    "compare with friction of free shape ('drivetwin examine --friction free')",
    build,
    random=True,
)
