# SPDX-License-Identifier: MIT
"""Unknowns of a part that a fit has in its plant beside the dual clutch.

The first unknown of a part is the logarithm of its size, so that the size stays positive.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivetwin.simulation.added_part import AddedPart, InputShaftMode, OutputBacklash
from drivetwin.simulation.dual_clutch import DualClutch
from drivetwin.vehicle.effects import EffectId

SIZE, SHARE, DAMPING = "ln_size", "share", "ln_damping"
"""Unknowns of a part: logarithm of the size, share of J1 in front of an input shaft, logarithm of
the damping ratio of the engine on it with the gearbox held."""


@dataclass(frozen=True)
class Extension:
    """Part that a plant has beside the dual clutch.

    `full_scale` is the largest magnitude of the measured output torque [N m]: the size of backlash
    refers to it.
    """

    effect: EffectId
    full_scale: float

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns of the fit, that of the size first."""
        return tuple(f"{self.effect}.{key}" for key in UNKNOWNS[self.effect])

    def build_part(self, model: DualClutch, values: Mapping[str, float]) -> AddedPart:
        """Build the part beside `model`; `values` are those of the unknowns by name."""
        size, *shape = (values[name] for name in self.unknowns)
        if self.effect is EffectId.BACKLASH:
            return OutputBacklash(2.0 * float(np.exp(size)) * self.full_scale / model.k_o)
        share, ln_damping = shape
        return InputShaftMode(float(np.exp(size)), share, float(np.exp(ln_damping)))


UNKNOWNS: Mapping[EffectId, tuple[str, ...]] = {
    EffectId.INPUT_SHAFT_MODE: (SIZE, SHARE, DAMPING),
    EffectId.BACKLASH: (SIZE,),
}
"""Unknowns of each part. The size of a mode is the frequency [Hz] at which the engine's share of
J1 swings with the gearbox held, that of backlash half a gap times k_o over the largest torque."""
