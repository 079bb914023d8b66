# SPDX-License-Identifier: MIT
"""Run the virtual dynamometer: scenario and seed in, recorded channels and their truth out.

A run may have effects that the dual-clutch model leaves out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.channels.roles import make_command_role, make_pressure_role
from drivetwin.channels.shiftlog import Channel
from drivetwin.dyno.scenario import ControlledActuator, Scenario, Sensor
from drivetwin.dyno.truth import SENSOR_EFFECTS, Effects, Truth, check_effects, compute_truth
from drivetwin.errors import InputError, SimulationError, Where
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import (
    NominalRun,
    SensorErrors,
    SyntheticVehicle,
    compute_friction_work,
)
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.simulation.added_elements import NO_ADDED_ELEMENTS, AddedElements
from drivetwin.simulation.driveline_run import DrivelineTask
from drivetwin.simulation.dual_clutch import FloatArray, Signal, Trajectory
from drivetwin.vehicle.effects import EffectId

_ROUNDS = 30
"""Most runs until friction work and the friction that falls with it agree."""
_AGREEMENT = 1e-9
"""Change of the friction work between two runs, over its total, at which they agree."""
_ROLE = "output_torque"


def changes_motion(scenario: Scenario, effects: Effects) -> bool:
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


def delay_output_torque(
    sensors: tuple[Sensor, ...], error: SensorErrors, effects: Effects
) -> tuple[Sensor, ...]:
    """Return the sensors with the delay of the output torque.

    Raises InputError for an effect in a sensor that is absent.
    """
    of_torque = SENSOR_EFFECTS - {EffectId.SPEED_RUN_OUT}
    wanted = [name for name in of_torque if effects.get(name, 0.0) > 0.0]
    if wanted and _ROLE not in [sensor.role for sensor in sensors]:
        raise InputError(
            f"{', '.join(sorted(wanted))}: the scenario records no output torque",
            "choose a scenario with an output torque sensor",
            Where(key="effect"),
        )
    return tuple(
        replace(one, delay=one.delay + error.delay) if one.role == _ROLE else one for one in sensors
    )


def apply_effects(
    nominal: NominalRun,
    effects: Effects,
    gears: Sequence[str],
    seed: int,
    heated: Trajectory | None = None,
) -> SyntheticVehicle:
    """Apply the effects to the vehicle of a scenario.

    Parameters
    ----------
    nominal
        Run without effects.
    effects
        Sizes, see `EFFECTS`.
    gears
        Shift elements in the order of the gears.
    seed
        Seed of the random effects.
    heated
        Run on the times of the nominal one, from whose friction work μ falls; the nominal one by
        default.

    Returns
    -------
    SyntheticVehicle
        Vehicle of the scenario with the effects.
    """
    vehicle = SyntheticVehicle.from_nominal(nominal, gears, seed, heated)
    for name, effect in EFFECTS.items():
        if effects.get(name, 0.0) > 0.0:
            vehicle = effect.apply(vehicle, effects[name])
    return vehicle


def simulate_with_effects(
    scenario: Scenario, nominal: NominalRun, effects: Effects, seed: int, time: FloatArray
) -> Trajectory:
    """Simulate the scenario with `effects` on `time` (n,) [s].

    μ that falls with the friction work is found by repetition: each run has the friction of the
    work of the run before it. A failed run returns its status.
    Raises SimulationError where the repetition does not converge.
    """
    gears, start = [gear.element for gear in scenario.gears], scenario.start()
    heated = nominal.trajectory
    for _ in range(_ROUNDS):
        vehicle = apply_effects(nominal, effects, gears, seed, heated)
        if effects.get(EffectId.FRICTION_HEAT, 0.0) == 0.0:
            return vehicle.simulate(start, time)
        run = vehicle.simulate(start, heated.time)
        if run.status != "completed" or _compute_change(run, heated) < _AGREEMENT:
            return apply_effects(nominal, effects, gears, seed, run).simulate(start, time)
        heated = run
    raise SimulationError(
        f"friction and its work do not agree after {_ROUNDS} runs",
        f"give a smaller {EffectId.FRICTION_HEAT}",
    )


def _compute_change(run: Trajectory, before: Trajectory) -> float:
    """Compute the largest change of the friction work of any element, over its total."""
    works = [(compute_friction_work(run, n), compute_friction_work(before, n)) for n in run.slip]
    return max(float(np.max(np.abs(a - b)) / max(float(b[-1]), 1.0)) for a, b in works)


@dataclass(frozen=True, eq=False)
class DynoRun:
    """Recorded `channels` of one run, each on its own time base, and their true values.

    `trajectory` is the exact motion at all instants that a sensor looked at.
    """

    scenario: Scenario
    seed: int
    noise: float
    channels: tuple[Channel, ...]
    truth: Truth
    trajectory: Trajectory


def run(
    scenario: Scenario,
    seed: int = 0,
    *,
    noise: float = 1.0,
    effects: Mapping[str, float] | Effects | None = None,
) -> DynoRun:
    """Simulate the scenario and record it.

    `noise` scales the white noise of all sensors; 0 makes them ideal (no noise, no rounding) while
    their rates and delays stay. `effects` are the sizes, by `EffectId`, of what the dual-clutch
    model leaves out; the truth stays that of the model. The same arguments give the same log, bit
    for bit.
    Raises SimulationError where the run does not complete, InputError for a noise that is negative
    or infinite and for impossible effects.
    """
    if not 0.0 <= noise < math.inf:
        raise InputError(
            f"a noise factor of {noise:g}",
            "give 0 for ideal sensors, 1 for the scenario's, or another positive factor",
            Where(key="noise"),
        )
    sizes = check_effects(effects or {})
    nominal, error = _compute_nominal(scenario, sizes, seed)
    sensors = delay_output_torque(scenario.sensors, error, sizes)
    seen = list_sampling_instants(sensors, scenario.duration)
    if nominal is None:
        trajectory, inputs = _simulate(scenario, _build_inputs(scenario), seen)
    else:
        trajectory = simulate_with_effects(scenario, nominal, sizes, seed, seen)
        _check_completed(scenario, trajectory)
        inputs = _build_inputs(scenario).list_by_role(scenario)
    motion = Motion(trajectory, scenario.model.i_in, inputs, error)
    channels = record_channels(sensors, scenario.duration, motion, noise, seed)
    truth = compute_truth(scenario, motion.trajectory, sizes)
    return DynoRun(scenario, seed, noise, channels, truth, motion.trajectory)


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion at all instants that a sensor samples, and what it does not hold.

    `inputs` by role are signals beside the trajectory, `error` are those of the sensors.
    """

    trajectory: Trajectory
    i_in: float
    inputs: Mapping[str, Signal]
    error: SensorErrors


def list_sampling_instants(sensors: Sequence[Sensor], duration: float) -> FloatArray:
    """List the instants (n,) [s] at which any sensor samples until `duration` [s], increasing."""
    looks = (
        _compute_sampling_instants(one, one.compute_stamps(duration)).ravel() for one in sensors
    )
    return np.unique(np.concatenate(list(looks)))


def record_channels(
    sensors: Sequence[Sensor], duration: float, motion: Motion, noise: float, seed: int
) -> tuple[Channel, ...]:
    """Record a motion until `duration` [s]; `noise` scales the white noise of all sensors."""
    generators = np.random.SeedSequence(seed).spawn(len(sensors))
    channels = []
    for sensor, generator in zip(sensors, generators, strict=True):
        stamps = sensor.compute_stamps(duration)
        exact = _compute_quantity(sensor, _compute_sampling_instants(sensor, stamps), motion)
        exact = exact + motion.error.compute(sensor.role, stamps, exact, motion.trajectory)
        channels.append(sensor.read(stamps, exact, noise, np.random.default_rng(generator)))
    return tuple(channels)


def _compute_nominal(
    scenario: Scenario, effects: Effects, seed: int
) -> tuple[NominalRun | None, SensorErrors]:
    """Compute the run to which effects on the motion are related, None without any, and the errors
    of the sensors."""
    if not effects:
        return None, SensorErrors()
    moving, given = changes_motion(scenario, effects), _build_inputs(scenario)
    grid = given.engine_torque.time
    reference, _ = _simulate(scenario, given, grid[grid <= scenario.duration])
    nominal = NominalRun(scenario.model, reference, given.engine_torque, given.pressures)
    gears = [gear.element for gear in scenario.gears]
    sensor = {name: size for name, size in effects.items() if name in SENSOR_EFFECTS}
    error = apply_effects(nominal, sensor, gears, seed).errors
    return nominal if moving else None, error


def _compute_sampling_instants(sensor: Sensor, stamps: FloatArray) -> FloatArray:
    """Sampling instants (n, m) [s] of a sensor, to the nanosecond: equal rates share instants."""
    return np.asarray(np.round(sensor.compute_instants(stamps), 9), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class _Inputs:
    """Engine torque [N m], pressures and their commands [Pa] of a scenario, as they are logged."""

    engine_torque: Signal
    pressures: Mapping[str, Signal]
    commands: Mapping[str, Signal]

    def list_by_role(self, scenario: Scenario) -> dict[str, Signal]:
        """The inputs by the role of their channel."""
        pressures = self.pressures
        if scenario.one_clutch:
            total = np.sum([each.values for each in pressures.values()], axis=0)
            both = Signal(self.engine_torque.time, np.asarray(total, dtype=np.float64))
            pressures = dict.fromkeys(pressures, both)
        roles = {make_pressure_role(name): pressure for name, pressure in pressures.items()}
        commands = {make_command_role(name): each for name, each in self.commands.items()}
        return {"engine_torque": self.engine_torque, **roles, **commands}


def _build_inputs(scenario: Scenario) -> _Inputs:
    grid = np.arange(int(np.ceil(scenario.duration * scenario.rate)) + 1) / scenario.rate
    pressures = {
        name: Signal(grid, actuator.compute_pressure(grid))
        for name, actuator in scenario.actuators.items()
    }
    commands = {
        name: actuator.compute_command(scenario.duration)
        for name, actuator in scenario.actuators.items()
        if isinstance(actuator, ControlledActuator)
    }
    held = {name: Signal(each.time, each.values) for name, each in commands.items()}
    return _Inputs(Signal(grid, scenario.compute_torque(grid)), pressures, held)


def _simulate(
    scenario: Scenario, inputs: _Inputs, time: FloatArray
) -> tuple[Trajectory, dict[str, Signal]]:
    """The exact motion at `time`, and by role what it does not hold: inputs, engine speed."""
    given = (inputs.engine_torque, inputs.pressures, scenario.start(), time)
    added = AddedElements(front=scenario.converter) if scenario.converter else NO_ADDED_ELEMENTS
    if scenario.plant is not None:
        trajectory = scenario.plant.simulate(scenario.model, *given)
    else:
        trajectory = DrivelineTask(scenario.model, added, *given).simulate()
    speeds = {}
    if trajectory.crank_speed is not None:
        speeds["engine_speed"] = Signal(time, trajectory.crank_speed)
    _check_completed(scenario, trajectory)
    return trajectory, {**inputs.list_by_role(scenario), **speeds}


def _check_completed(scenario: Scenario, trajectory: Trajectory) -> None:
    if trajectory.status != "completed":
        raise SimulationError(
            f"scenario {scenario.name!r} ended with status {trajectory.status!r}",
            "change its pressure commands or parameters so that the elements can hold the load",
        )


def _compute_quantity(sensor: Sensor, at: FloatArray, motion: Motion) -> FloatArray:
    """The exact quantity (n,) that `sensor` sees as means over the instants `at` (n, m)."""
    trajectory = motion.trajectory
    if sensor.role in motion.inputs:
        signal = motion.inputs[sensor.role]
        return _compute_means(at, signal.time, signal.values)
    outputs = {
        "output_torque": trajectory.shaft_torque,
        "input_speed": trajectory.engine_speed / motion.i_in,
        "output_speed": trajectory.output_speed,
        "wheel_speed": trajectory.wheel_speed,
    }
    return _compute_means(at, trajectory.time, outputs[sensor.role])


def _compute_means(at: FloatArray, time: FloatArray, values: FloatArray) -> FloatArray:
    """Means (n,) of a quantity over each row of the instants `at` (n, m)."""
    return np.asarray(np.mean(np.interp(at, time, values), axis=1), dtype=np.float64)
