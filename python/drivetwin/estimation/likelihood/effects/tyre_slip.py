# SPDX-License-Identifier: MIT
"""Slip of the driven tyres in proportion to their force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.extended_response import (
    CutForce,
    build_extended_rates,
    solve_extended,
)
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint, compute_middle
from drivetwin.simulation.vehicle_parts import RIM_SHARE
from drivetwin.vehicle.effects import EffectId

MIN_SPEED = 1.0
"""Least wheel speed [rad/s] at which a slip is defined."""
START_STEPS = 5
"""Steps over which the initial slip is averaged."""


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Let the vehicle follow its wheels by a slip in proportion to their torque.

    Fifth state: difference s of the speeds of wheel and vehicle, s·C/ω_w the torque between them,
    in the rigid run i_f·T_o - J_w·ω_w'.
    """
    wheel, vehicle = RIM_SHARE * at.model.J_v, (1.0 - RIM_SHARE) * at.model.J_v
    speed = np.maximum(compute_middle(at.run.wheel_speed), MIN_SPEED)
    stiffness = at.model.i_f * at.largest_shaft_torque / std / speed
    reduced = replace(at.model, J_v=wheel)
    row = np.zeros((at.middle.size, 5))
    row[:, 4] = stiffness
    shaft = at.model.i_f * compute_middle(at.run.shaft_torque)
    rigid = shaft - wheel * at.compute_rate(at.run.wheel_speed)
    cut = CutForce(2, row, np.full(at.middle.size, -1.0), rigid)
    rates = build_extended_rates(at, reduced, cut)
    rates.matrix[:, 4] = rates.matrix[:, 2] - row / vehicle
    rates.drive[:, 4] = rates.drive[:, 2] + rigid / vehicle
    start = np.zeros(5)
    start[4] = np.mean(rigid[:START_STEPS]) / stiffness[0]
    return [Disturbance(respond=lambda: solve_extended(at, reduced, rates, start))]


EFFECT = Effect(
    EffectId.TYRE_SLIP,
    "slip of the driven tyres",
    "slip at the largest shaft torque",
    0.001,
    "lower end of a typical range at the traction of a shift, 0.1 to 0.5 %; see Pacejka, Tire and "
    "Vehicle Dynamics, on longitudinal stiffness",
    "measure a wheel speed and the vehicle speed, or use a chassis dynamometer with known slip",
    build,
    curved=True,
)
