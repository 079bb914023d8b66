# SPDX-License-Identifier: MIT
"""Effects of compliances: modes and laws of the shafts, backlash, slip of the tyres."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.data.shift_record import OUTPUT_TORQUE
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
from drivetwin.simulation.added_elements import (
    RIM_SHARE,
    InputShaft,
    ShaftTable,
    TyreSlip,
    compute_gap,
)
from drivetwin.simulation.dual_clutch import DualClutch
from drivetwin.vehicle.effects import EffectId

_MODE_SHARE, _MODE_DAMPING = 0.5, 0.06
"""Share of J1 at the engine and damping ratio of the mode in a synthetic log."""


def build_input_shaft_mode(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Build no column: k_o absorbs a mode before it shows, so it is tried in the plant alone."""
    del at, std
    return []


def apply_input_shaft_mode(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Put a shaft into J1."""
    front = InputShaft.from_mode(_MODE_SHARE * vehicle.model.J1, size, _MODE_DAMPING)
    return replace(vehicle, added=replace(vehicle.added, front=front))


INPUT_SHAFT_MODE = Effect(
    EffectId.INPUT_SHAFT_MODE,
    "a second torsional mode at the gearbox input",
    "Hz",
    50.0,
    "middle of the typical range of torsional dampers and input shafts of trucks and cars, 20 to "
    "130 Hz with the gearbox held",
    "the mode moves k_o, c_o and J′: compare its frequency with that of the torsional damper",
    build_input_shaft_mode,
    apply_input_shaft_mode,
    has_columns=False,
)


def build_shaft_disturbance(at: OperatingPoint, torque: FloatArray) -> Disturbance:
    """Build the action of an additional shaft torque (N,) [N m] on both of its ends and on the
    output torque that is measured there."""
    middle = compute_middle(torque)
    force = at.build_force(1, -middle) + at.build_force(2, at.model.i_f * middle)
    return Disturbance(force=force, outputs={OUTPUT_TORQUE: torque})


ROUNDING = 0.03
"""Share of the largest torque over which the sign is rounded: a sensor's noise about zero."""
REVERSED = 0.5
"""Change of the rounded sign from which the torque counts as reversed."""


def build_backlash(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Shift the characteristic of the shaft by half the gap to the side of its torque.

    Half a gap Δ with T = k_o·(φ - Δ·sign T) changes the torque at a given twist by -k_o·Δ·sign T.
    Nothing where the torque keeps its sign: the gap is then part of the initial twist.
    """
    largest = at.largest_shaft_torque
    sign = np.tanh(at.run.shaft_torque / (ROUNDING * largest))
    if np.ptp(sign) <= REVERSED:
        return []
    return [build_shaft_disturbance(at, -std * largest * (sign - sign[0]))]


def apply_backlash(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Give the output shaft its play."""
    gap = compute_gap(size, vehicle.nominal.largest_shaft_torque, vehicle.model.k_o)
    return replace(vehicle, added=replace(vehicle.added, gap=gap))


BACKLASH = Effect(
    EffectId.BACKLASH,
    "backlash in the driveline",
    "half gap times stiffness, of the largest shaft torque",
    0.03,
    "typical range of 1 to 3 degrees at the wheel, less what the preload takes; see Lagerberg and "
    "Egardt, IEEE Trans. CST 15, 2007, on backlash of powertrains",
    "use shifts in which the shaft torque keeps its sign",
    build_backlash,
    apply_backlash,
)


def build_progressive_shaft(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Add a cubic term to the torque over the twist, less half of it at the largest torque."""
    linear = at.model.k_o * at.run.twist
    cubic = linear * ((linear / at.largest_shaft_torque) ** 2 - 0.5)
    return [build_shaft_disturbance(at, std * cubic)]


def apply_progressive_shaft(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Replace the linear output shaft by a table."""
    full = vehicle.nominal.largest_shaft_torque
    table = ShaftTable.from_factor(vehicle.model.k_o, full, size)
    return replace(vehicle, added=replace(vehicle.added, shaft_table=table))


PROGRESSIVE_SHAFT = Effect(
    EffectId.PROGRESSIVE_SHAFT,
    "a shaft that stiffens with its twist",
    "of the stiffness at the largest shaft torque",
    0.015,
    "engineering estimate: joints, splines and tyres in series with a steel shaft make a "
    "characteristic progressive by 1 to 3 %",
    "compare shifts at two torque levels",
    build_progressive_shaft,
    apply_progressive_shaft,
    limit=2.0,
)


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
    return replace(vehicle, added=replace(vehicle.added, tyre=tyre))


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


EFFECTS = (
    INPUT_SHAFT_MODE,
    BACKLASH,
    PROGRESSIVE_SHAFT,
    TYRE_SLIP,
)
