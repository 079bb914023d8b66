# SPDX-License-Identifier: MIT
"""Effects of compliances: modes and laws of the shafts, backlash, slip of the tyres."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.effects.effect import (
    Disturbance,
    Effect,
    OperatingPoint,
    compute_middle,
)
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import SyntheticVehicle
from drivetwin.estimation.likelihood.torque_record import OUTPUT_TORQUE
from drivetwin.simulation.added_elements import InputShaft, ShaftTable, TyreSlip, compute_gap
from drivetwin.simulation.driveline import OUTPUT, WHEEL
from drivetwin.simulation.dual_clutch import DualClutch
from drivetwin.vehicle.effects import EffectId

_MODE_SHARE, _MODE_DAMPING = 0.5, 0.06
"""Share of J1 at the engine and damping ratio of the mode in a synthetic log."""


def build_input_shaft_mode(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Build no column: k_o absorbs a mode before it shows, so it is tried in the plant alone."""
    del at, std
    return []


def build_input_shaft(model: DualClutch, frequency: float) -> InputShaft:
    """Build the shaft of a synthetic log, with its mode at a `frequency` [Hz]."""
    return InputShaft.from_mode(_MODE_SHARE * model.J1, frequency, _MODE_DAMPING)


def apply_input_shaft_mode(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Put a shaft into J1."""
    front = build_input_shaft(vehicle.model, size)
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
    torques = {OUTPUT: -middle, WHEEL: at.model.i_f * middle}
    return Disturbance(torques=torques, outputs={OUTPUT_TORQUE: torque})


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


def build_tyre_slip(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Put a tyre of this slip between the wheel and the vehicle: linear, as a column is."""
    tyre = TyreSlip.from_slip(at.model.i_f * at.largest_shaft_torque, std, at.model.J_v)
    tyre = tyre.linearise(float(at.run.wheel_speed[0]))
    added = at.term.plant.build_added_elements(at.point, at.model)
    return [Disturbance(outputs=at.compute_change(replace(added, tyre=tyre)))]


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
