# SPDX-License-Identifier: MIT
"""Effects that a fit has in its plant beside the dual clutch, and their unknowns.

A size that cannot be negative is sought by its logarithm, another by its value.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from drivetwin.simulation.dual_clutch import DualClutch
from drivetwin.simulation.part_parameters import (
    BACKLASH,
    MODE_DAMPING,
    MODE_FREQUENCY,
    MODE_SHARE,
    PROGRESSION,
    REFERENCE,
    TYRE_SLIP,
)
from drivetwin.simulation.variable import exp
from drivetwin.simulation.vehicle_parts import compute_gap
from drivetwin.vehicle.effects import EffectId

SIZE, AMOUNT, SHARE, DAMPING = "ln_size", "amount", "share", "ln_damping"
"""Unknowns of a part: logarithm of the size, signed size in its unit, share of J1 in front of an
input shaft, logarithm of the damping ratio of the engine on it with the gearbox held."""
UNKNOWNS: Mapping[EffectId, tuple[str, ...]] = {
    EffectId.INPUT_SHAFT_MODE: (SIZE, SHARE, DAMPING),
    EffectId.BACKLASH: (SIZE,),
    EffectId.TYRE_SLIP: (SIZE,),
    EffectId.PROGRESSIVE_SHAFT: (AMOUNT,),
}
"""Unknowns of each effect that a plant may have, that of the size first. Sizes are in the unit of
`EffectId`; that of a mode is the frequency [Hz] at which the engine's share of J1 swings. Drag and
an efficiency by gear are not among them: they change the engine torque that drives the run of the
correction, so that their columns are as exact as a plant."""


@dataclass(frozen=True)
class PlantEffect:
    """Effect that a plant has beside the dual clutch.

    `output_torque` is the largest magnitude measured [N m], FS of `EffectId`.
    """

    effect: EffectId
    output_torque: float

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns of the fit, that of the size first."""
        return tuple(f"{self.effect}.{key}" for key in UNKNOWNS[self.effect])

    def get_size(self, first: float) -> float:
        """Return the size, in the unit of the effect, at a value of the first unknown."""
        return first if self.is_signed else exp(first)

    @property
    def is_signed(self) -> bool:
        """True where the size may be negative."""
        return UNKNOWNS[self.effect][0] == AMOUNT

    def compute_values(self, model: DualClutch, unknowns: Mapping[str, float]) -> dict[str, float]:
        """Compute the parameters of the part by id from the `unknowns` by name."""
        first, *shape = (unknowns[name] for name in self.unknowns)
        size = self.get_size(first)
        full = self.output_torque
        match self.effect:
            case EffectId.INPUT_SHAFT_MODE:
                share, ln_damping = shape
                names = (MODE_FREQUENCY, MODE_SHARE, MODE_DAMPING)
                return dict(zip(names, (size, share, exp(ln_damping)), strict=True))
            case EffectId.BACKLASH:
                return {BACKLASH: compute_gap(size, full, model.k_o)}
            case EffectId.TYRE_SLIP:
                return {TYRE_SLIP: size, REFERENCE: full}
            case _:
                return {PROGRESSION: size, REFERENCE: full}
