# SPDX-License-Identifier: MIT
"""Parts beside the dual clutch that a fit may have in its plant: one each, of unknown size.

The plant is then the network of `simulation.departed_driveline`. The first unknown of a part is the
logarithm of its size, so that the size stays positive.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.simulation.departed_driveline import DepartedDriveline
from drivetwin.simulation.departed_start import compute_quasi_steady_state
from drivetwin.simulation.departure import Departure, InputShaft
from drivetwin.simulation.dual_clutch import DualClutch, Signal, State, Trajectory
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

    def simulate(
        self,
        model: DualClutch,
        values: FloatArray,
        inputs: tuple[Signal, Mapping[str, Signal]],
        start: State,
        time: FloatArray,
    ) -> Trajectory:
        """Simulate `model` with the part on `time` (n,) [s].

        `values` (k,) are those of the unknowns; `inputs` are the torque and pressures that act. The
        twist of `start` is the one that makes torque: that of a gap is added.
        Raises InputError where the description is inconsistent.
        """
        departure = self._build_departure(model, *values.tolist())
        torque, pressures = inputs
        acting = float(np.interp(time[0], torque.arrival, torque.values))
        state = compute_quasi_steady_state(model, departure, start, acting)
        gap = 0.5 * departure.gap * float(np.sign(start.twist))
        plant = DepartedDriveline(model, departure, [one.name for one in model.elements])
        state = replace(state, twist=start.twist + gap)
        return plant.simulate(torque, pressures, start, time, state)

    def _build_departure(
        self, model: DualClutch, ln_size: float, share: float = 0.0, ln_damping: float = 0.0
    ) -> Departure:
        size = float(np.exp(ln_size))
        if self.effect is EffectId.BACKLASH:
            return replace(_build_none(model), gap=2.0 * size * self.full_scale / model.k_o)
        return _build_input_shaft(model, size, share, float(np.exp(ln_damping)))


UNKNOWNS: Mapping[EffectId, tuple[str, ...]] = {
    EffectId.INPUT_SHAFT_MODE: (SIZE, SHARE, DAMPING),
    EffectId.BACKLASH: (SIZE,),
}
"""Unknowns of each part. The size of a mode is the frequency [Hz] at which the engine's share of
J1 swings with the gearbox held, that of backlash half a gap times k_o over the largest torque."""


def _build_input_shaft(
    model: DualClutch, frequency: float, share: float, damping: float
) -> Departure:
    """Split J1 by a shaft on which the engine's share swings at `frequency` [Hz]."""
    inertia, omega = share * model.J1, 2.0 * np.pi * frequency
    shaft = InputShaft(inertia * omega**2, 2.0 * damping * omega * inertia, inertia)
    return replace(_build_none(model), input_shaft=shaft)


def _build_none(model: DualClutch) -> Departure:
    return Departure(model.elements, model.load, None, 0.0, 0.0, 0.0, None, None, 0.0, None)
