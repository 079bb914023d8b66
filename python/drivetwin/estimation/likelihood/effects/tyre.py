# SPDX-License-Identifier: MIT
"""Slip of the driven tyres, and the response of a driveline with an additional state."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.effects.effect import (
    Disturbance,
    Effect,
    OperatingPoint,
    compute_middle,
)
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import SyntheticVehicle
from drivetwin.estimation.likelihood.noise.shift_response import (
    STATES,
    LinearRates,
    compute_exponentials,
    compute_rates,
    iterate_jumps,
)
from drivetwin.simulation.dual_clutch import DualClutch
from drivetwin.simulation.vehicle_parts import RIM_SHARE, TyreSlip
from drivetwin.vehicle.effects import EffectId


@dataclass(frozen=True, eq=False)
class CutForce:
    """Torque that acts on one of the speeds in place of that of the rigid driveline.

    `speed` is the index of that speed, `row` (N-1, m) gives the torque in the cut from the m
    states, `gain` (N-1,) its action on the speed, `rigid` (N-1,) is the torque in the cut of the
    rigid run.
    """

    speed: int
    row: FloatArray
    gain: FloatArray
    rigid: FloatArray


@dataclass(frozen=True, eq=False)
class ExtendedRates:
    """Rates z' = matrix·z + drive of m states over each step: (N-1, m, m) and (N-1, m)."""

    matrix: FloatArray
    drive: FloatArray


def build_extended_rates(at: OperatingPoint, reduced: DualClutch, cut: CutForce) -> ExtendedRates:
    """Build the rates of the four states of the driveline; those of the others stay zero.

    `reduced` is the model without the inertia behind the cut.
    """
    rates: LinearRates = compute_rates(reduced, at.run, at.record)
    count, states = cut.row.shape
    matrix, drive = np.zeros((count, states, states)), np.zeros((count, states))
    matrix[:, :STATES, :STATES] = rates.rate
    along = rates.inverse[:, :, cut.speed] * cut.gain[:, None]
    matrix[:, :STATES, :] += along[:, :, None] * cut.row[:, None, :]
    drive[:, :STATES] = -along * cut.rigid[:, None]
    return ExtendedRates(matrix, drive)


def solve_extended(
    at: OperatingPoint, reduced: DualClutch, rates: ExtendedRates, start: FloatArray
) -> FloatArray:
    """Solve for the states of the driveline (N, 4) from the `start` (m,) of all states."""
    step = np.diff(at.run.time)
    with np.errstate(over="ignore", invalid="ignore"):
        transition, mean = compute_exponentials(rates.matrix * step[:, None, None])
    push = np.einsum("kij,kj->ki", mean, rates.drive * step[:, None])
    for k, jump in iterate_jumps(reduced, at.run):
        whole = np.eye(start.size)
        whole[:STATES, :STATES] = jump
        transition[k], push[k] = whole @ transition[k], whole @ push[k]
    return _propagate(transition, push, start)[:, :STATES]


def _propagate(transition: FloatArray, push: FloatArray, start: FloatArray) -> FloatArray:
    """Propagate z_{k+1} = transition_k·z_k + push_k; returns z (N, m)."""
    state = np.empty((len(transition) + 1, start.size))
    state[0] = start
    with np.errstate(over="ignore", invalid="ignore"):
        for k, (matrix, change) in enumerate(zip(transition, push, strict=True)):
            state[k + 1] = matrix @ state[k] + change
    return state


MIN_SPEED = 1.0
"""Least wheel speed [rad/s] at which a slip is defined."""
START_STEPS = 5
"""Steps over which the initial slip is averaged."""


def build_tyre_slip(at: OperatingPoint, std: float) -> list[Disturbance]:
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


def apply_tyre_slip(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Put a tyre between the wheel and the vehicle."""
    torque = vehicle.nominal.largest_shaft_torque * vehicle.model.i_f
    tyre = TyreSlip.from_slip(torque, size, vehicle.model.J_v)
    return replace(vehicle, parts=replace(vehicle.parts, tyre=tyre))


TYRE_SLIP = Effect(
    EffectId.TYRE_SLIP,
    "slip of the driven tyres",
    "slip at the largest shaft torque",
    0.001,
    "lower end of a typical range at the traction of a shift, 0.1 to 0.5 %; see Pacejka, Tire and "
    "Vehicle Dynamics, on longitudinal stiffness",
    "measure a wheel speed and the vehicle speed, or use a chassis dynamometer with known slip",
    build_tyre_slip,
    apply_tyre_slip,
    limit=1.0,
    curved=True,
)


EFFECTS = (TYRE_SLIP,)
