# SPDX-License-Identifier: MIT
"""Run the virtual dynamometer: scenario and seed in, recorded channels and their truth out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.channels.pressure_roles import make_pressure_role
from drivetwin.channels.shiftlog import Channel
from drivetwin.dyno.scenario import Scenario
from drivetwin.dyno.sensors import Sensor
from drivetwin.dyno.truth import Truth, compute_truth
from drivetwin.errors import InputError, SimulationError, Where
from drivetwin.simulation import dual_clutch
from drivetwin.simulation.dual_clutch import Signal, Trajectory

FloatArray = NDArray[np.float64]


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


def run(scenario: Scenario, seed: int = 0, *, noise: float = 1.0) -> DynoRun:
    """Simulate the scenario and record it.

    `noise` scales the white noise of all sensors; 0 makes them ideal (no noise, no rounding) while
    their rates and delays stay. The same arguments give the same log, bit for bit.
    Raises SimulationError where the run does not complete, InputError for a negative noise.
    """
    if not noise >= 0.0:
        raise InputError(
            f"a noise factor of {noise:g}",
            "give 0 for ideal sensors, 1 for the scenario's, or another positive factor",
            Where(key="noise"),
        )
    stamps = {sensor.role: sensor.compute_stamps(scenario.duration) for sensor in scenario.sensors}
    looks = {
        sensor.role: _compute_sampling_instants(sensor, stamps[sensor.role])
        for sensor in scenario.sensors
    }
    seen = np.unique(np.concatenate([instants.ravel() for instants in looks.values()]))
    trajectory, inputs = _simulate(scenario, seen)
    generators = np.random.SeedSequence(seed).spawn(len(scenario.sensors))
    channels = tuple(
        sensor.read(
            stamps[sensor.role],
            _compute_quantity(
                sensor, looks[sensor.role], (trajectory, scenario.model.i_in), inputs
            ),
            noise,
            np.random.default_rng(generator),
        )
        for sensor, generator in zip(scenario.sensors, generators, strict=True)
    )
    return DynoRun(scenario, seed, noise, channels, compute_truth(scenario, trajectory), trajectory)


def _compute_sampling_instants(sensor: Sensor, stamps: FloatArray) -> FloatArray:
    """Sampling instants (n, m) [s] of a sensor, to the nanosecond: equal rates share instants."""
    return np.asarray(np.round(sensor.compute_instants(stamps), 9), dtype=np.float64)


def _simulate(scenario: Scenario, time: FloatArray) -> tuple[Trajectory, dict[str, Signal]]:
    """The exact motion at `time`, and by role what it does not hold: inputs, engine speed."""
    grid = np.arange(int(np.ceil(scenario.duration * scenario.rate)) + 1) / scenario.rate
    pressures = {
        name: Signal(grid, actuator.compute_pressure(grid))
        for name, actuator in scenario.actuators.items()
    }
    torque = Signal(grid, scenario.compute_torque(grid))
    given = (scenario.model, torque, pressures, scenario.start(), time)
    speeds = {}
    if scenario.converter is not None:
        trajectory, crank = scenario.converter.simulate(*given)
        speeds["engine_speed"] = Signal(time, crank)
    else:
        run = dual_clutch.simulate if scenario.plant is None else scenario.plant.simulate
        trajectory = run(*given)
    if trajectory.status != "completed":
        raise SimulationError(
            f"scenario {scenario.name!r} ended with status {trajectory.status!r}",
            "change its pressure commands or parameters so that the elements can hold the load",
        )
    if scenario.one_clutch:
        total = np.sum([each.values for each in pressures.values()], axis=0)
        both = Signal(grid, np.asarray(total, dtype=np.float64))
        pressures = dict.fromkeys(pressures, both)
    inputs = {make_pressure_role(name): pressure for name, pressure in pressures.items()}
    return trajectory, {"engine_torque": torque, **inputs, **speeds}


def _compute_quantity(
    sensor: Sensor, at: FloatArray, motion: tuple[Trajectory, float], inputs: dict[str, Signal]
) -> FloatArray:
    """The exact quantity (n,) that `sensor` sees as means over the instants `at` (n, m).

    `motion` is the trajectory and i_in.
    """
    trajectory, i_in = motion
    if sensor.role in inputs:
        signal = inputs[sensor.role]
        return _compute_means(at, signal.time, signal.values)
    outputs = {
        "output_torque": trajectory.shaft_torque,
        "input_speed": trajectory.engine_speed / i_in,
        "output_speed": trajectory.output_speed,
        "wheel_speed": trajectory.wheel_speed,
    }
    return _compute_means(at, trajectory.time, outputs[sensor.role])


def _compute_means(at: FloatArray, time: FloatArray, values: FloatArray) -> FloatArray:
    """Means (n,) of a quantity over each row of the instants `at` (n, m)."""
    return np.asarray(np.mean(np.interp(at, time, values), axis=1), dtype=np.float64)
