# SPDX-License-Identifier: MIT
"""Effects that are torques: loads at the wheel, losses and drums of the gearbox."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.estimation.direct.load_balance import AERO
from drivetwin.estimation.likelihood.effects.effect import (
    Disturbance,
    Effect,
    OperatingPoint,
    WalkStream,
    build_random_walk,
    compute_middle,
    draw_walk,
)
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import SyntheticVehicle
from drivetwin.estimation.likelihood.torque_record import TORQUE
from drivetwin.simulation.driveline import INPUT, OUTPUT, WHEEL
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.vehicle.effects import EffectId

COUNT = 6
"""Columns of the walk; faster changes of a load are averaged out by the vehicle's inertia."""


def build_slow_load(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Let the load at the wheel follow a random walk over the shift."""
    growth = std * at.load * at.model.i_f * float(np.sqrt(at.duration))
    columns = build_random_walk(at.progress, COUNT, growth)
    label = at.describe_shift()
    return [Disturbance(label, {WHEEL: -compute_middle(one)}) for one in columns]


def apply_slow_load(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Add a random walk to the load."""
    nominal = vehicle.nominal
    walk = draw_walk(WalkStream.LOAD, vehicle.seed, float(nominal.trajectory.time[-1]))
    signal = Signal(walk.time, size * nominal.load * walk.values)
    return replace(vehicle, added=replace(vehicle.added, walk=signal))


SLOW_LOAD = Effect(
    EffectId.SLOW_LOAD,
    "a load that changes slowly, as by grade or wind",
    "of the load per square root of a second",
    0.004,
    "engineering estimate for level roads: the grade changes by 0.01 to 0.05 % over 100 m, of the "
    "order of a hundredth of the load",
    "record on a level track or a dynamometer, and several shifts in both directions",
    build_slow_load,
    apply_slow_load,
    random=True,
)


def build_aero_load(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Let a share of the load grow with the square of the wheel speed, held at the mean speed.

    Nothing where the fit has this part of the load as an unknown.
    """
    if AERO in at.point.names:
        return []
    square = compute_middle(at.run.wheel_speed) ** 2
    growth = square / max(at.term.plant.mean_speed**2, 1e-9) - 1.0
    torque = std * at.load * at.model.i_f * growth
    return [Disturbance(torques={WHEEL: -torque})]


def apply_aero_load(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Let the share of the load grow with the square of the speed."""
    nominal, load = vehicle.nominal, vehicle.model.load
    growing = size * nominal.load
    aero = load.aero + growing / nominal.mean_wheel_speed**2
    grown = replace(load, constant=load.constant - growing, aero=aero)
    return replace(vehicle, model=replace(vehicle.model, load=grown))


AERO_LOAD = Effect(
    EffectId.AERO_LOAD,
    "a load that grows with the square of the speed",
    "of the load",
    0.1,
    "typical share of air drag in the road load of a truck below 40 km/h, about a tenth; see "
    "Mitschke and Wallentowitz, Dynamik der Kraftfahrzeuge, on driving resistances",
    "record a longer stretch in gear, or a coast-down from a higher speed",
    build_aero_load,
    apply_aero_load,
    limit=1.0,
)


def build_brake_drag(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Let a brake torque at the wheel fall linearly to zero over the record of the shift.

    A constant drag is part of the constant load, which is an unknown of the fit.
    """
    torque = std * at.load * at.model.i_f * (1.0 - compute_middle(at.progress))
    return [Disturbance(at.describe_shift(), {WHEEL: -torque})]


def apply_brake_drag(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Add a constant drag torque to the wheel."""
    drag = size * abs(vehicle.nominal.load)
    return replace(vehicle, added=replace(vehicle.added, brake_drag=drag))


BRAKE_DRAG = Effect(
    EffectId.BRAKE_DRAG,
    "a residual brake torque that fades",
    "of the load, at the start of the shift's record",
    0.005,
    "engineering estimate: released pads keep of the order of a hundredth of the load, half of "
    "which fades within a record",
    "record without braking before the shift, and check that the brakes release",
    build_brake_drag,
    apply_brake_drag,
)


def build_efficiency_by_gear(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Change the torque of the engine by what another η passes on in the gear that is entered.

    The model's η is that of the gear that is left. The share of the on-coming element blends both.
    """
    driveline = at.term.plant.driveline
    torque = at.engine_torque - at.model.J1 * at.compute_rate(at.run.engine_speed)
    change = std * torque * at.oncoming_share / at.model.eta
    subject = f"{driveline.i_before:.4g} to {driveline.i_after:.4g}"
    return [Disturbance(subject, inputs={TORQUE: change})]


def apply_efficiency_by_gear(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Let the efficiency of each gear exceed that of the gear before by the size."""
    step = size / vehicle.model.eta
    efficiency = {name: 1.0 + k * step for k, name in enumerate(vehicle.gears) if k}
    return replace(vehicle, added=replace(vehicle.added, efficiency=efficiency))


EFFICIENCY_BY_GEAR = Effect(
    EffectId.EFFICIENCY_BY_GEAR,
    "an efficiency that differs between the gears",
    "1",
    0.01,
    "typical loss of one more gear mesh in the power flow, 0.5 to 1.5 %; see Niemann and Winter, "
    "Maschinenelemente II, on losses of gears",
    "check eta of each gear by pedal steps in it",
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
    return replace(vehicle, added=replace(vehicle.added, input_drag=drag))


INPUT_DRAG = Effect(
    EffectId.INPUT_DRAG,
    "drag at the gearbox input, or an offset of the engine torque",
    "of the largest engine torque",
    0.005,
    "typical range of open wet clutches and pump, 0.3 to 1 % of the rated torque; see Kitabayashi "
    "et al., SAE 2003-01-1973, on drag of wet clutches",
    "calibrate the engine torque at zero load, and measure the drag",
    build_input_drag,
    apply_input_drag,
)


REFERENCE_TORQUE = 1500.0
"""Engine torque [N m] to which the prior refers: drums grow with the torque that they carry."""


def build_drum_inertia(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Add the torque of an inertia that rotates with the slip of each element without a drum."""
    size = std * at.largest_engine_torque / REFERENCE_TORQUE
    stated = {one.name for one in at.term.plant.driveline.drums}
    found = []
    for one in at.model.elements:
        if one.name in stated:
            continue
        torque = size * at.compute_rate(at.run.slip[one.name])
        torques = {INPUT: -torque / one.i_c, OUTPUT: torque * one.i_out}
        found.append(Disturbance(one.name, torques))
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


EFFECTS = (
    SLOW_LOAD,
    AERO_LOAD,
    BRAKE_DRAG,
    EFFICIENCY_BY_GEAR,
    INPUT_DRAG,
    DRUM_INERTIA,
)
