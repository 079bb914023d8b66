# SPDX-License-Identifier: MIT
"""Run of a scenario whose vehicle departs from the dual-clutch model: inputs, vehicle, motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.signal_processing import apply_lag, integrate_trapezoids
from drivetwin.dyno.effects import SENSOR_EFFECTS, Effects
from drivetwin.dyno.random_walk import WalkStream, draw_walk
from drivetwin.dyno.scenario import Scenario
from drivetwin.errors import InputError, SimulationError, Where
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

_LEAST_SLIP = 1e-6
"""Slip [rad/s] above the round-off of a locked element."""


@dataclass(frozen=True, eq=False)
class NominalRun:
    """Motion without effects, and its inputs: engine torque [N m] and pressures [Pa]."""

    model: DualClutch
    trajectory: Trajectory
    engine_torque: Signal
    pressures: Mapping[str, Signal]

    @property
    def largest_engine_torque(self) -> float:
        """Largest magnitude of the engine torque, T0 [N m]."""
        return float(np.max(np.abs(self.engine_torque.values)))

    @property
    def largest_shaft_torque(self) -> float:
        """Largest magnitude of the output shaft's torque, FS [N m]."""
        return float(np.max(np.abs(self.trajectory.shaft_torque)))

    @property
    def mean_wheel_speed(self) -> float:
        """Mean speed of the wheel [rad/s]."""
        time = self.trajectory.time
        distance = float(np.trapezoid(self.trajectory.wheel_speed, time))
        return distance / float(time[-1] - time[0])

    @property
    def load(self) -> float:
        """Load at the wheel at its mean speed, L [N m]."""
        return self.model.load.evaluate(self.mean_wheel_speed)

    def get_largest_slip(self, element: str) -> float:
        """Largest magnitude of the slip at which the element transmits torque [rad/s]."""
        slip = self.trajectory.slip[element][self._find_slipping(element)]
        return float(np.max(np.abs(slip), initial=0.0))

    def get_pressure_range(self, element: str, P0: float) -> float:
        """Largest pressure above `P0` at which the element slips [Pa]."""
        signal = self.pressures[element]
        pressure = np.interp(self.trajectory.time, signal.arrival, signal.values)
        return float(np.max(pressure[self._find_slipping(element)] - P0, initial=0.0))

    def _find_slipping(self, element: str) -> NDArray[np.bool_]:
        run = self.trajectory
        moving = np.abs(run.slip[element]) > _LEAST_SLIP
        return np.asarray(moving & (run.clutch_torque[element] != 0.0))


def compute_friction_work(run: Trajectory, element: str) -> FloatArray:
    """Friction work of an element from the start on (n,) [J]."""
    power: FloatArray = np.abs(run.clutch_torque[element] * run.slip[element])
    return integrate_trapezoids(power, run.time)


def lag_input(logged: Signal, time_constant: float) -> Signal:
    """Apply a first-order lag [s] to an evenly sampled input, at rest before its start."""
    if time_constant == 0.0:
        return logged
    step = float(logged.time[1] - logged.time[0])
    return Signal(logged.time, apply_lag(logged.values, step, time_constant))


def delay_input(logged: Signal, delay: float) -> Signal:
    """Delay an input by a time [s]; it has its first value before it starts."""
    if delay == 0.0:
        return logged
    time = np.concatenate([[logged.time[0] - delay], logged.time])
    return Signal(time, np.concatenate([logged.values[:1], logged.values]), delay)


def scale_capacity(
    acting: Signal, element: ShiftElement, nominal: NominalRun, effects: Effects, work: FloatArray
) -> Signal:
    """Replace a pressure [Pa] by the one at which the element has the capacity with effects.

    The capacity is μ·gain·(P - P0), so a factor of μ acts as the same factor of P - P0. `work` (n,)
    [J] is the friction work on the times of the nominal run.
    """
    excess = np.maximum(acting.values - element.P0, 0.0)
    factor = np.ones_like(excess)
    rise = effects.get(EffectId.FRICTION_PRESSURE, 0.0)
    span = nominal.get_pressure_range(element.name, element.P0)
    if rise > 0.0 and span > 0.0:
        factor *= 1.0 + rise * (np.minimum(excess / span, 1.0) - 0.5)
    fall = effects.get(EffectId.FRICTION_HEAT, 0.0)
    whole = float(compute_friction_work(nominal.trajectory, element.name)[-1])
    if fall > 0.0 and whole > 0.0:
        share = np.interp(acting.arrival, nominal.trajectory.time, work) / whole
        factor *= np.maximum(1.0 - fall * share, 0.0)
    return Signal(acting.time, acting.values + (factor - 1.0) * excess, acting.delay)


def build_acting_inputs(
    nominal: NominalRun, effects: Effects, heated: Trajectory
) -> tuple[Signal, dict[str, Signal]]:
    """Return engine torque [N m] and pressures [Pa] as they act.

    `heated` is a run on the times of the nominal one, from whose friction work μ falls.
    """
    torque = lag_input(nominal.engine_torque, effects.get(EffectId.TORQUE_LAG, 0.0))
    late = effects.get(EffectId.PRESSURE_DELAY, 0.0)
    pressures = {
        each.name: scale_capacity(
            delay_input(nominal.pressures[each.name], late),
            each,
            nominal,
            effects,
            compute_friction_work(heated, each.name),
        )
        for each in nominal.model.elements
    }
    return torque, pressures


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


_ROUNDS = 30
"""Most runs until friction work and the friction that falls with it agree."""
_AGREEMENT = 1e-9
"""Change of the friction work between two runs, over its total, at which they agree."""


def is_departed(scenario: Scenario, effects: Effects) -> bool:
    """Return whether an effect changes the motion, and not the sensors alone.

    Raises InputError where it does and the scenario is none of a plain dual clutch.
    """
    moving = [name for name in effects if name not in SENSOR_EFFECTS]
    if moving and not (scenario.plant is None and scenario.converter is None):
        raise InputError(
            f"{', '.join(moving)} in scenario {scenario.name!r}, "
            "which has a whole gearbox or an open converter",
            f"choose a scenario of a dual clutch, or any of {', '.join(sorted(SENSOR_EFFECTS))}",
            Where(key="effect"),
        )
    return bool(moving)


def simulate_departed(
    scenario: Scenario, nominal: NominalRun, effects: Effects, seed: int, time: FloatArray
) -> Trajectory:
    """Simulate the scenario with `effects` on `time` (n,) [s].

    μ that falls with the friction work is found by repetition: each run has the friction of the
    work of the run before it. A failed run returns its status.
    Raises SimulationError where the repetition does not converge.
    """
    gears = [gear.element for gear in scenario.gears]
    vehicle = compute_vehicle(nominal, effects, gears, seed)
    heated = nominal.trajectory
    if effects.get(EffectId.FRICTION_HEAT, 0.0) > 0.0:
        heated = _heat(scenario, nominal, effects, vehicle)
    inputs = build_acting_inputs(nominal, effects, heated)
    return vehicle.simulate(*inputs, scenario.start(), time)


def _heat(
    scenario: Scenario, nominal: NominalRun, effects: Effects, vehicle: DepartedVehicle
) -> Trajectory:
    """Find the run, on the times of the nominal one, with the friction of its own work."""
    heated = nominal.trajectory
    for _ in range(_ROUNDS):
        inputs = build_acting_inputs(nominal, effects, heated)
        run = vehicle.simulate(*inputs, scenario.start(), heated.time)
        if run.status != "completed" or _compute_change(run, heated) < _AGREEMENT:
            return run
        heated = run
    raise SimulationError(
        f"friction and its work do not agree after {_ROUNDS} runs",
        f"give a smaller {EffectId.FRICTION_HEAT}",
    )


def _compute_change(run: Trajectory, before: Trajectory) -> float:
    """Largest change of the friction work of any element, over its total."""
    works = [(compute_friction_work(run, n), compute_friction_work(before, n)) for n in run.slip]
    return max(float(np.max(np.abs(a - b)) / max(float(b[-1]), 1.0)) for a, b in works)
