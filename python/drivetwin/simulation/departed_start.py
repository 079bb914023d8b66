# SPDX-License-Identifier: MIT
"""Quasi-steady acceleration of a driveline with added parts."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin.simulation.departure import Departure
from drivetwin.simulation.dual_clutch import DualClutch, State


@dataclass(frozen=True)
class QuasiSteadyState:
    """Twists [rad] of output and input shaft, speed of the vehicle at the wheel [rad/s]."""

    twist: float
    input_twist: float
    vehicle_speed: float


def compute_quasi_steady_state(
    model: DualClutch, departure: Departure, start: State, engine_torque: float
) -> QuasiSteadyState:
    """Compute the state in which all parts accelerate alike in the gear that `start` holds.

    The drums of open elements are left out, as in `DualClutch.compute_steady_torque`.
    """
    wheel, (gear, *_) = start.wheel_speed, start.locked
    walk = 0.0 if departure.walk is None else float(departure.walk.values[0])
    braking = departure.brake_drag * float(np.sign(wheel))
    constant = departure.load.constant + walk + braking
    loaded = replace(model, load=replace(departure.load, constant=constant))
    ratio = model.get_overall_ratio(gear)
    torque = loaded.compute_steady_torque(engine_torque - departure.input_drag, ratio, wheel)
    rate = (model.i_f * torque - loaded.load.evaluate(wheel)) / model.J_v
    return QuasiSteadyState(
        _compute_twist(model, departure, torque),
        _compute_input_twist(departure, engine_torque, ratio * model.i_f * rate),
        _compute_vehicle_speed(departure, wheel, model.i_f * torque - braking, rate),
    )


def _compute_twist(model: DualClutch, departure: Departure, torque: float) -> float:
    """Twist [rad] at which the output shaft has `torque` [N m]."""
    if departure.shaft_table is not None:
        return float(np.interp(torque, departure.shaft_table.torque, departure.shaft_table.twist))
    return torque / model.k_o + 0.5 * departure.gap * float(np.sign(torque))


def _compute_input_twist(departure: Departure, engine_torque: float, rate: float) -> float:
    """Twist [rad] of the input shaft while the engine accelerates by `rate` [rad/s²]."""
    if departure.input_shaft is None:
        return 0.0
    shaft = departure.input_shaft
    return (engine_torque - shaft.inertia * rate) / shaft.stiffness


def _compute_vehicle_speed(departure: Departure, wheel: float, torque: float, rate: float) -> float:
    """Speed of the vehicle at the wheel [rad/s] by the slip of the tyre under `torque` [N m]."""
    if departure.tyre is None:
        return wheel
    passed = torque - departure.tyre.rim_inertia * rate
    return wheel / (1.0 + passed / departure.tyre.slip_stiffness * float(np.sign(wheel)))
