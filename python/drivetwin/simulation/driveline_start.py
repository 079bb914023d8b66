# SPDX-License-Identifier: MIT
"""Start of a run of a driveline with parts: quasi-steady acceleration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from drivetwin.simulation.driveline import CRANK, ENGINE, INPUT_SHAFT, OUTPUT, SHAFT, VEHICLE, WHEEL
from drivetwin.simulation.dual_clutch import DualClutch, Signal, State
from drivetwin.simulation.network import Start
from drivetwin.simulation.variable import sign
from drivetwin.simulation.vehicle_parts import InputShaft, OpenConverter, VehicleParts

_STALL = 0.05
"""Least speed ratio looked at for the steady state of a converter."""


def settle(
    model: DualClutch, parts: VehicleParts, start: State, engine_torque: Signal, time: float
) -> State:
    """Return a start with the twist of the output shaft that quasi-steady acceleration has.

    `engine_torque` is the acting one, `time` [s] the instant of the start. The twist is without
    the play of the shaft.
    """
    torque, _ = _solve_acceleration(model, parts, start, _interpolate(engine_torque, time))
    return replace(start, twist=compute_twist(model, parts, torque))


def compute_twist(model: DualClutch, parts: VehicleParts, torque: float) -> float:
    """Compute the twist [rad] at which the output shaft has `torque` [N m], without its play."""
    table = parts.shaft_table
    if table is None:
        return torque / model.k_o
    return float(np.interp(torque, table.torque, table.twist))


def build_start(
    model: DualClutch, parts: VehicleParts, start: State, engine_torque: Signal, time: float
) -> Start:
    """Build the start of the network: speeds and twist of `start`, the rest quasi-steady.

    The twist of `start` is the one that makes torque: half of the play is added. `engine_torque` is
    the acting one, `time` [s] the instant of the start.
    """
    speeds = {ENGINE: start.engine_speed, OUTPUT: start.output_speed, WHEEL: start.wheel_speed}
    twists = {SHAFT: start.twist + 0.5 * parts.gap * sign(start.twist)}
    front, tyre = parts.front, parts.tyre
    if front is None and tyre is None:
        return Start(speeds, twists, start.locked)
    drive = _interpolate(engine_torque, time)
    if isinstance(front, OpenConverter):
        speeds[CRANK] = solve_steady_speed(front, drive, start.engine_speed)
        return Start(speeds, twists, start.locked)
    torque, rate = _solve_acceleration(model, parts, start, drive)
    if isinstance(front, InputShaft):
        speeds[CRANK] = start.engine_speed
        ratio = model.get_overall_ratio(start.locked[0]) * model.i_f
        twists[INPUT_SHAFT] = (drive - front.inertia * (ratio * rate)) / front.stiffness
    if tyre is not None:
        wheel = start.wheel_speed
        braking = parts.brake_drag * sign(wheel)
        passed = model.i_f * torque - braking - tyre.rim_inertia * rate
        speeds[VEHICLE] = wheel / (1.0 + passed / tyre.slip_stiffness * sign(wheel))
    return Start(speeds, twists, start.locked)


def solve_steady_speed(front: OpenConverter, torque: float, turbine: float) -> float:
    """Return the speed of the engine [rad/s] that gives `torque` [N m] steadily.

    `turbine` is the speed of the turbine [rad/s].
    """

    def surplus(ratio: float) -> float:
        return float(front.converter.compute_pump_torque(turbine / ratio, turbine)) - torque

    return turbine / float(brentq(surplus, _STALL, 1.0))


def _interpolate(engine_torque: Signal, time: float) -> float:
    return float(np.interp(time, engine_torque.arrival, engine_torque.values))


def _solve_acceleration(
    model: DualClutch, parts: VehicleParts, start: State, engine_torque: float
) -> tuple[float, float]:
    """Return the torque of the output shaft [N m] and the acceleration of the wheel [rad/s²].

    All parts accelerate alike in the gear that `start` holds. The drums of open elements are left
    out, as in `DualClutch.compute_steady_torque`.
    """
    wheel, (gear, *_) = start.wheel_speed, start.locked
    walk = 0.0 if parts.walk is None else float(parts.walk.values[0])
    constant = model.load.constant + walk + parts.brake_drag * sign(wheel)
    loaded = replace(model, load=replace(model.load, constant=constant))
    ratio = model.get_overall_ratio(gear)
    torque = loaded.compute_steady_torque(engine_torque - parts.input_drag, ratio, wheel)
    return torque, (model.i_f * torque - loaded.load.evaluate(wheel)) / model.J_v
