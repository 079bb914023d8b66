# SPDX-License-Identifier: MIT
"""Departure of a scenario's vehicle from the dual-clutch model, from the sizes of its effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.dyno.effects import Effects
from drivetwin.dyno.nominal import NominalRun
from drivetwin.dyno.random_walk import WalkStream, draw_walk
from drivetwin.simulation.departure import Departure, InputShaft, ShaftTable, TyreSlip
from drivetwin.simulation.dual_clutch import (
    FrictionTable,
    RoadLoad,
    ShiftElement,
    Signal,
    Stribeck,
)
from drivetwin.vehicle.effects import EffectId

_MODE_DAMPING = 0.06
"""Damping ratio of the input shaft's mode."""
_RIM_SHARE = 0.02
"""Share of the vehicle's inertia before the tyre: rims, tyres and side shafts."""
_TABLE_END, _TABLE_STEP = 2.5, 1.0 / 32.0
"""Range and step of the table of a progressive shaft, over FS: errors below 1e-3 of the factor."""
_WAVES = 2.0
"""Periods of the wave of μ over the slips of an element."""
_SLIP_RANGE, _SLIP_STEPS = 1.25, 250
"""Range of a table of μ over the largest slip of the nominal run, and number of its pieces."""


def compute_departure(nominal: NominalRun, effects: Effects, seed: int) -> Departure:
    """Compute the added parts from the sizes of the effects and the run without them."""

    def size(name: EffectId) -> float:
        return effects.get(name, 0.0)

    model, full = nominal.model, nominal.largest_shaft_torque
    return Departure(
        elements=tuple(
            replace(
                each,
                drum_inertia=each.drum_inertia + size(EffectId.DRUM_INERTIA),
                friction=_build_friction(each, nominal, size(EffectId.FRICTION_SHAPE)),
            )
            for each in model.elements
        ),
        load=_compute_load(nominal, size(EffectId.AERO_LOAD)),
        walk=_draw_load_walk(nominal, size(EffectId.SLOW_LOAD), seed),
        efficiency=size(EffectId.EFFICIENCY_BY_GEAR),
        input_drag=size(EffectId.INPUT_DRAG) * nominal.largest_engine_torque,
        brake_drag=size(EffectId.BRAKE_DRAG) * abs(nominal.load),
        input_shaft=_compute_input_shaft(0.5 * model.J1, size(EffectId.INPUT_SHAFT_MODE)),
        tyre=_compute_tyre(nominal, size(EffectId.TYRE_SLIP)),
        gap=2.0 * size(EffectId.BACKLASH) * full / model.k_o,
        shaft_table=_compute_shaft_table(full, model.k_o, size(EffectId.PROGRESSIVE_SHAFT)),
    )


def _build_friction(
    element: ShiftElement, nominal: NominalRun, amplitude: float
) -> Stribeck | FrictionTable:
    largest = nominal.get_largest_slip(element.name)
    if amplitude == 0.0 or largest == 0.0:
        return element.friction
    share = np.linspace(0.0, _SLIP_RANGE, _SLIP_STEPS + 1)
    mu = element.friction.evaluate(largest * share)
    mu = mu + amplitude * np.sin(2.0 * np.pi * _WAVES * share)
    return FrictionTable(tuple((largest * share).tolist()), tuple(mu.tolist()))


def _compute_load(nominal: NominalRun, share: float) -> RoadLoad:
    load, growing = nominal.model.load, share * nominal.load
    aero = growing / nominal.mean_wheel_speed**2
    return replace(load, constant=load.constant - growing, aero=load.aero + aero)


def _draw_load_walk(nominal: NominalRun, share: float, seed: int) -> Signal | None:
    if share == 0.0:
        return None
    walk = draw_walk(WalkStream.LOAD, seed, float(nominal.trajectory.time[-1]))
    return Signal(walk.time, share * nominal.load * walk.values)


def _compute_input_shaft(inertia: float, frequency: float) -> InputShaft | None:
    """The shaft on which `inertia` [kg m^2] swings at `frequency` [Hz] against a held gearbox."""
    if frequency == 0.0:
        return None
    omega = 2.0 * np.pi * frequency
    return InputShaft(inertia * omega**2, 2.0 * _MODE_DAMPING * omega * inertia, inertia)


def _compute_tyre(nominal: NominalRun, slip: float) -> TyreSlip | None:
    if slip == 0.0:
        return None
    torque = nominal.largest_shaft_torque * nominal.model.i_f
    return TyreSlip(torque / slip, _RIM_SHARE * nominal.model.J_v)


def _compute_shaft_table(full: float, stiffness: float, factor: float) -> ShaftTable | None:
    if factor == 0.0:
        return None
    count = 2 * round(_TABLE_END / _TABLE_STEP) + 1
    share = np.linspace(-_TABLE_END, _TABLE_END, count)
    torque = full * share * (1.0 + factor * (share**2 - 0.5))
    return ShaftTable(full / stiffness * share, torque)
