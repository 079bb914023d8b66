# SPDX-License-Identifier: MIT
"""Table of the effects that a fit may have in its plant beside the dual clutch.

A size that cannot be negative is sought by its logarithm, another by its value.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import log

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
from drivetwin.vehicle.spec import PriorValue

Compute = Callable[[DualClutch, float, Sequence[float]], dict[str, float]]
"""Computes parameters by id from the dual clutch, the largest output torque and the values of the
unknowns, the size in place of its logarithm."""


@dataclass(frozen=True)
class PlantRow:
    """Row of the table: how an effect changes the plant.

    `compute` gives the parameters of the added element. `shape` are the priors of its unknowns
    beside the size by name. `starts` are initial values of the first unknown where no column shows
    one, in standard deviations from its prior mean. `spread` is the prior standard deviation of the
    logarithm of the size, None for that of all effects; `signed` sizes have no logarithm.
    """

    compute: Compute
    shape: Mapping[str, PriorValue] = field(default_factory=dict)
    starts: tuple[float, ...] = (0.0,)
    spread: float | None = None
    signed: bool = False

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns, that of the size first."""
        return ("amount" if self.signed else "ln_size", *self.shape)


PLANTS: Mapping[EffectId, PlantRow] = {
    # Share of J1 in front of the shaft: flywheel and crankshaft against pump, converter or primary
    # masses. Damping ratio of the engine on it with the gearbox held: 2 to 13 % hold 95 %. 0.4 to
    # 2.7 times the usual frequency hold 95 %. Q has several minima: a low mode is not found from a
    # usual one, and a high one moves little.
    EffectId.INPUT_SHAFT_MODE: PlantRow(
        lambda _, __, own: {
            MODE_FREQUENCY: own[0],
            MODE_SHARE: own[1],
            MODE_DAMPING: exp(own[2]),
        },
        {"share": PriorValue(0.5, 0.12), "ln_damping": PriorValue(log(0.05), 0.5)},
        starts=(-1.0, 0.0),
        spread=0.5,
    ),
    EffectId.BACKLASH: PlantRow(
        lambda model, full, own: {BACKLASH: compute_gap(own[0], full, model.k_o)},
        starts=(-0.2, 0.3),
    ),
    EffectId.TYRE_SLIP: PlantRow(lambda _, full, own: {TYRE_SLIP: own[0], REFERENCE: full}),
    EffectId.PROGRESSIVE_SHAFT: PlantRow(
        lambda _, full, own: {PROGRESSION: own[0], REFERENCE: full}, signed=True
    ),
}
"""Effects that a plant may have. Sizes are in the unit of the effect's entry; that of a mode is the
frequency [Hz] at which the engine's share of J1 swings. Drag and an efficiency by gear are not
among them: they change the engine torque that drives the run of the correction, so that their
columns are as exact as a plant."""


@dataclass(frozen=True)
class PlantEffect:
    """Effect that a plant has beside the dual clutch.

    `output_torque` is the largest magnitude measured [N m].
    """

    effect: EffectId
    output_torque: float

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns of the fit, that of the size first."""
        return tuple(f"{self.effect}.{key}" for key in PLANTS[self.effect].unknowns)

    def get_size(self, first: float) -> float:
        """Return the size, in the unit of the effect, at a value of the first unknown."""
        return first if self.is_signed else exp(first)

    @property
    def is_signed(self) -> bool:
        """True where the size may be negative."""
        return PLANTS[self.effect].signed

    def compute_values(self, model: DualClutch, unknowns: Mapping[str, float]) -> dict[str, float]:
        """Compute the parameters of the added element by id from the `unknowns` by name."""
        first, *shape = (unknowns[name] for name in self.unknowns)
        own = (self.get_size(first), *shape)
        return PLANTS[self.effect].compute(model, self.output_torque, own)
