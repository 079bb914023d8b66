# SPDX-License-Identifier: MIT
"""Parts that the plant of a shift may have beside the dual clutch, one at a time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.simulation import dual_clutch
from drivetwin.simulation.departed_driveline import DepartedDriveline
from drivetwin.simulation.departed_start import compute_quasi_steady_state
from drivetwin.simulation.departure import Departure, InputShaft
from drivetwin.simulation.dual_clutch import DualClutch, FloatArray, Signal, State, Trajectory


@dataclass(frozen=True)
class InputShaftMode:
    """A shaft inside J1.

    `share` of J1 is in front of it and swings at `frequency` [Hz] with the ratio `damping` while
    the gearbox is held.
    """

    frequency: float
    share: float
    damping: float

    @property
    def label(self) -> str:
        """Name of the part with its size."""
        return f"an input shaft with a mode at {self.frequency:.3g} Hz"

    def build_departure(self, model: DualClutch) -> Departure:
        """Split J1 by the shaft."""
        inertia, omega = self.share * model.J1, 2.0 * np.pi * self.frequency
        shaft = InputShaft(inertia * omega**2, 2.0 * self.damping * omega * inertia, inertia)
        return replace(_build_none(model), input_shaft=shaft)


@dataclass(frozen=True)
class OutputBacklash:
    """Play `gap` [rad] of the output shaft."""

    gap: float

    @property
    def label(self) -> str:
        """Name of the part with its size."""
        return f"backlash of {self.gap:.2g} rad in the output shaft"

    def build_departure(self, model: DualClutch) -> Departure:
        """Give the output shaft the play."""
        return replace(_build_none(model), gap=self.gap)


AddedPart = InputShaftMode | OutputBacklash
MODE_IDS, BACKLASH_ID = ("mode_frequency", "mode_share", "mode_damping"), "backlash"
"""Ids of the parameters of the parts, in the order of their fields."""


def get_part_values(part: AddedPart | None) -> dict[str, float]:
    """Return the parameters of a part by id."""
    if part is None:
        return {}
    if isinstance(part, OutputBacklash):
        return {BACKLASH_ID: part.gap}
    return dict(zip(MODE_IDS, (part.frequency, part.share, part.damping), strict=True))


def build_part(values: Mapping[str, float]) -> AddedPart | None:
    """Build the part that parameters by id describe; None where they describe none."""
    if BACKLASH_ID in values:
        return OutputBacklash(values[BACKLASH_ID])
    if all(name in values for name in MODE_IDS):
        return InputShaftMode(*(values[name] for name in MODE_IDS))
    return None


def simulate_plant(
    model: DualClutch,
    part: AddedPart | None,
    engine_torque: Signal,
    pressures: Mapping[str, Signal],
    start: State,
    time: FloatArray,
) -> Trajectory:
    """Simulate the dual clutch, with `part` as a network, on `time` (n,) [s].

    `engine_torque` and `pressures` are the acting ones. The twist of `start` is the one that makes
    torque: half a gap is added.
    Raises InputError where the description is inconsistent.
    """
    if part is None:
        return dual_clutch.simulate(model, engine_torque, pressures, start, time)
    departure = part.build_departure(model)
    torque = float(np.interp(time[0], engine_torque.arrival, engine_torque.values))
    state = compute_quasi_steady_state(model, departure, start, torque)
    gap = 0.5 * departure.gap * float(np.sign(start.twist))
    plant = DepartedDriveline(model, departure, [one.name for one in model.elements])
    state = replace(state, twist=start.twist + gap)
    return plant.simulate(engine_torque, pressures, start, time, state)


def _build_none(model: DualClutch) -> Departure:
    return Departure(model.elements, model.load, None, 0.0, 0.0, 0.0, None, None, 0.0, None)
