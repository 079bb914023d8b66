# SPDX-License-Identifier: MIT
"""Parts beside the dual clutch that a fit may have in its plant: one each, of unknown size.

The plant is then the network of `simulation.departed_driveline`. The unknown is the logarithm of
the size, so that the size stays positive.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.simulation.departed_driveline import DepartedDriveline
from drivetwin.simulation.departed_start import compute_quasi_steady_state
from drivetwin.simulation.departure import Departure, InputShaft
from drivetwin.simulation.dual_clutch import DualClutch, Signal, State, Trajectory
from drivetwin.vehicle.effects import EffectId

MODE_DAMPING = 0.06
"""Damping ratio of the input shaft's mode, usual for a torsional damper."""
ENGINE_SHARE = 0.5
"""Share of J1 in front of the input shaft."""


@dataclass(frozen=True)
class Extension:
    """Part that a plant has beside the dual clutch.

    `full_scale` is the largest magnitude of the measured output torque [N m]: the size of backlash
    refers to it.
    """

    effect: EffectId
    full_scale: float

    @property
    def unknown(self) -> str:
        """Name of the unknown of the fit: the logarithm of the size."""
        return f"{self.effect}.ln_size"

    def simulate(
        self,
        model: DualClutch,
        ln_size: float,
        inputs: tuple[Signal, Mapping[str, Signal]],
        start: State,
        time: FloatArray,
    ) -> Trajectory:
        """Simulate `model` with the part on `time` (n,) [s]; `inputs` are those that act.

        The twist of `start` is the one that makes torque: that of a gap is added.
        Raises InputError where the description is inconsistent.
        """
        departure = _BUILDERS[self.effect](model, float(np.exp(ln_size)), self.full_scale)
        torque, pressures = inputs
        acting = float(np.interp(time[0], torque.arrival, torque.values))
        state = compute_quasi_steady_state(model, departure, start, acting)
        gap = 0.5 * departure.gap * float(np.sign(start.twist))
        plant = DepartedDriveline(model, departure, [one.name for one in model.elements])
        state = replace(state, twist=start.twist + gap)
        return plant.simulate(torque, pressures, start, time, state)


def _build_input_shaft(model: DualClutch, frequency: float, _: float) -> Departure:
    """Split J1 by a shaft on which the engine's share swings at `frequency` [Hz], the gearbox
    held."""
    inertia, omega = ENGINE_SHARE * model.J1, 2.0 * np.pi * frequency
    damping = 2.0 * MODE_DAMPING * omega * inertia
    return replace(_build_none(model), input_shaft=InputShaft(inertia * omega**2, damping))


def _build_gap(model: DualClutch, share: float, full_scale: float) -> Departure:
    """Give the output shaft a gap; half of it times the stiffness is `share` of the largest
    torque."""
    return replace(_build_none(model), gap=2.0 * share * full_scale / model.k_o)


def _build_none(model: DualClutch) -> Departure:
    return Departure(model.elements, model.load, None, 0.0, 0.0, 0.0, None, None, 0.0, None)


_BUILDERS: Mapping[EffectId, Callable[[DualClutch, float, float], Departure]] = {
    EffectId.INPUT_SHAFT_MODE: _build_input_shaft,
    EffectId.BACKLASH: _build_gap,
}
