# SPDX-License-Identifier: MIT
"""Loads at the wheel that the constant load of a shift leaves out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

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
from drivetwin.estimation.linear.load_balance import AERO
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.vehicle.effects import EffectId

COUNT = 6
"""Columns of the walk; faster changes of a load are averaged out by the vehicle's inertia."""


def build_slow_load(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Let the load at the wheel follow a random walk over the shift."""
    growth = std * at.load * at.model.i_f * float(np.sqrt(at.duration))
    columns = build_random_walk(at.progress, COUNT, growth)
    label = at.describe_shift()
    return [Disturbance(label, at.build_force(2, -compute_middle(one))) for one in columns]


def apply_slow_load(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Add a random walk to the load."""
    nominal = vehicle.nominal
    walk = draw_walk(WalkStream.LOAD, vehicle.seed, float(nominal.trajectory.time[-1]))
    signal = Signal(walk.time, size * nominal.load * walk.values)
    return replace(vehicle, parts=replace(vehicle.parts, walk=signal))


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
    growth = square / max(at.part.structure.mean_speed**2, 1e-9) - 1.0
    torque = std * at.load * at.model.i_f * growth
    return [Disturbance(force=at.build_force(2, -torque))]


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
    return [Disturbance(at.describe_shift(), force=at.build_force(2, -torque))]


def apply_brake_drag(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Add a constant drag torque to the wheel."""
    drag = size * abs(vehicle.nominal.load)
    return replace(vehicle, parts=replace(vehicle.parts, brake_drag=drag))


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


EFFECTS = (SLOW_LOAD, AERO_LOAD, BRAKE_DRAG)
