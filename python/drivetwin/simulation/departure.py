# SPDX-License-Identifier: MIT
"""Physical values of the parts by which a vehicle departs from the dual-clutch model."""

from __future__ import annotations

from dataclasses import dataclass

from drivetwin.simulation.dual_clutch import FloatArray, RoadLoad, ShiftElement, Signal


@dataclass(frozen=True)
class InputShaft:
    """Shaft inside J1: stiffness [N m/rad], damping [N m s/rad], inertia in front [kg m^2]."""

    stiffness: float
    damping: float
    inertia: float


@dataclass(frozen=True)
class TyreSlip:
    """Torque at the wheel over slip [N m], and the inertia before the tyre [kg m^2]."""

    slip_stiffness: float
    rim_inertia: float


@dataclass(frozen=True, eq=False)
class ShaftTable:
    """Twists (n,) [rad] and torques (n,) [N m] of a progressive shaft."""

    twist: FloatArray
    torque: FloatArray


@dataclass(frozen=True, eq=False)
class Departure:
    """Values of the added parts; None or 0 where a part is absent.

    `input_drag` and `brake_drag` [N m] oppose the motion of gearbox input and wheel, `efficiency`
    is the step of η from gear to gear, `gap` [rad] the play of the output shaft, `walk` [N m] the
    part of the load that varies slowly, against the motion. `elements` have their own drums and
    laws of friction.
    """

    elements: tuple[ShiftElement, ...]
    load: RoadLoad
    walk: Signal | None
    efficiency: float
    input_drag: float
    brake_drag: float
    input_shaft: InputShaft | None
    tyre: TyreSlip | None
    gap: float
    shaft_table: ShaftTable | None
