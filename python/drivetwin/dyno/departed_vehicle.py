# SPDX-License-Identifier: MIT
"""Vehicle of a scenario with effects, from their sizes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.dyno.effects import Effects
from drivetwin.dyno.nominal import NominalRun
from drivetwin.dyno.random_walk import WalkStream, draw_walk
from drivetwin.simulation.driveline_run import DrivelineTask
from drivetwin.simulation.driveline_start import settle
from drivetwin.simulation.dual_clutch import (
    DualClutch,
    FloatArray,
    FrictionTable,
    RoadLoad,
    ShiftElement,
    Signal,
    State,
    Stribeck,
    Trajectory,
)
from drivetwin.simulation.vehicle_parts import (
    InputShaft,
    ShaftTable,
    TyreSlip,
    VehicleParts,
    compute_gap,
)
from drivetwin.vehicle.effects import EffectId

_MODE_DAMPING = 0.06
"""Damping ratio of the input shaft's mode."""
_WAVES = 2.0
"""Periods of the wave of μ over the slips of an element."""
_SLIP_RANGE, _SLIP_STEPS = 1.25, 250
"""Range of a table of μ over the largest slip of the nominal run, and number of its pieces."""


@dataclass(frozen=True, eq=False)
class DepartedVehicle:
    """Model with its own drums, friction and load, and the parts beside it."""

    model: DualClutch
    parts: VehicleParts

    def simulate(
        self,
        engine_torque: Signal,
        pressures: Mapping[str, Signal],
        start: State,
        time: FloatArray,
    ) -> Trajectory:
        """Simulate on `time` (n,) [s]; a failed run returns its status.

        `engine_torque` and `pressures` are the acting ones. Of `start` the speeds and the locked
        element hold, the rest is that of quasi-steady acceleration.
        Raises InputError where the description is inconsistent.
        """
        settled = settle(self.model, self.parts, start, engine_torque, float(time[0]))
        given = (engine_torque, pressures, settled, time)
        return DrivelineTask(self.model, self.parts, *given).simulate()


def compute_vehicle(
    nominal: NominalRun, effects: Effects, gears: Sequence[str], seed: int
) -> DepartedVehicle:
    """Compute the vehicle from the sizes of the effects and the run without them.

    Parameters
    ----------
    nominal
        Run without effects.
    effects
        Sizes, see `EffectId`.
    gears
        Shift elements in the order of the gears.
    seed
        Seed of the random effects.

    Returns
    -------
    DepartedVehicle
        Vehicle of the scenario with the effects.
    """

    def size(name: EffectId) -> float:
        return effects.get(name, 0.0)

    model, full = nominal.model, nominal.largest_shaft_torque
    elements = (
        replace(
            each,
            drum_inertia=each.drum_inertia + size(EffectId.DRUM_INERTIA),
            friction=_build_friction(each, nominal, size(EffectId.FRICTION_SHAPE)),
        )
        for each in model.elements
    )
    load = _compute_load(nominal, size(EffectId.AERO_LOAD))
    step = size(EffectId.EFFICIENCY_BY_GEAR) / model.eta
    mode, slip = size(EffectId.INPUT_SHAFT_MODE), size(EffectId.TYRE_SLIP)
    progression = size(EffectId.PROGRESSIVE_SHAFT)
    parts = VehicleParts(
        front=InputShaft.from_mode(0.5 * model.J1, mode, _MODE_DAMPING) if mode else None,
        input_drag=size(EffectId.INPUT_DRAG) * nominal.largest_engine_torque,
        efficiency={name: 1.0 + k * step for k, name in enumerate(gears) if k and step},
        gap=compute_gap(size(EffectId.BACKLASH), full, model.k_o),
        shaft_table=ShaftTable.from_factor(model.k_o, full, progression) if progression else None,
        brake_drag=size(EffectId.BRAKE_DRAG) * abs(nominal.load),
        tyre=TyreSlip.from_slip(full * model.i_f, slip, model.J_v) if slip else None,
        walk=_draw_load_walk(nominal, size(EffectId.SLOW_LOAD), seed),
    )
    return DepartedVehicle(replace(model, elements=tuple(elements), load=load), parts)


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
