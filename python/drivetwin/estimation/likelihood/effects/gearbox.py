# SPDX-License-Identifier: MIT
"""Losses and inertias in the gearbox that the dual clutch does not have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.estimation.likelihood.data.shift_record import TORQUE
from drivetwin.estimation.likelihood.effects.effect import (
    Disturbance,
    Effect,
    OperatingPoint,
    compute_middle,
)
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import SyntheticVehicle
from drivetwin.estimation.likelihood.noise.shift_response import build_slip_row
from drivetwin.vehicle.effects import EffectId


def build_efficiency_by_gear(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Change the torque of the engine by what another η passes on in the gear that is entered.

    The model's η is that of the gear that is left. The share of the on-coming element blends both.
    """
    driveline = at.part.structure.driveline
    torque = at.engine_torque - at.model.J1 * at.compute_rate(at.run.engine_speed)
    change = std * torque * at.oncoming_share / at.model.eta
    subject = f"{driveline.i_before:.4g} to {driveline.i_after:.4g}"
    return [Disturbance(subject, inputs={TORQUE: change})]


def apply_efficiency_by_gear(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Let the efficiency of each gear exceed that of the gear before by the size."""
    step = size / vehicle.model.eta
    efficiency = {name: 1.0 + k * step for k, name in enumerate(vehicle.gears) if k}
    return replace(vehicle, parts=replace(vehicle.parts, efficiency=efficiency))


EFFICIENCY_BY_GEAR = Effect(
    EffectId.EFFICIENCY_BY_GEAR,
    "an efficiency that differs between the gears",
    "1",
    0.01,
    "typical loss of one more gear mesh in the power flow, 0.5 to 1.5 %; see Niemann and Winter, "
    "Maschinenelemente II, on losses of gears",
    "state eta for one gear on the card, or identify each gear from pedal steps in it",
    build_efficiency_by_gear,
    apply_efficiency_by_gear,
)


def build_input_drag(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Subtract the drag from the torque through the gears; an offset of the engine torque is the
    same."""
    size = std * at.largest_engine_torque
    speed = compute_middle(at.run.engine_speed) / float(np.mean(at.run.engine_speed))
    shapes = (np.ones_like(speed), speed - 1.0)
    return [Disturbance(inputs={TORQUE: -size * shape}) for shape in shapes]


def apply_input_drag(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Add a constant drag torque to the gearbox input."""
    drag = size * vehicle.nominal.largest_engine_torque
    return replace(vehicle, parts=replace(vehicle.parts, input_drag=drag))


INPUT_DRAG = Effect(
    EffectId.INPUT_DRAG,
    "drag at the gearbox input, or an offset of the engine torque",
    "of the largest engine torque",
    0.005,
    "typical range of open wet clutches and pump, 0.3 to 1 % of the rated torque; see Kitabayashi "
    "et al., SAE 2003-01-1973, on drag of wet clutches",
    "calibrate the engine torque at zero load, or state the drag under [effects]",
    build_input_drag,
    apply_input_drag,
)


REFERENCE_TORQUE = 1500.0
"""Engine torque [N m] to which the prior refers: drums grow with the torque that they carry."""


def build_drum_inertia(at: OperatingPoint, std: float) -> list[Disturbance]:
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


def apply_drum_inertia(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Add the inertia [kg m^2] to every drum."""
    elements = vehicle.model.elements
    return vehicle.replace_elements(
        [replace(one, drum_inertia=one.drum_inertia + size) for one in elements]
    )


DRUM_INERTIA = Effect(
    EffectId.DRUM_INERTIA,
    "a drum inertia that the card does not state",
    "kg m² per 1500 N m of engine torque",
    0.03,
    "engineering estimate for heavy-duty boxes of 1500 N m: drums of 5 to 10 kg at a radius of "
    "0.08 m",
    "state drum_inertia_kgm2 of the element on the card",
    build_drum_inertia,
    apply_drum_inertia,
)


EFFECTS = (EFFICIENCY_BY_GEAR, INPUT_DRAG, DRUM_INERTIA)
