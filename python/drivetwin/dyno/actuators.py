# SPDX-License-Identifier: MIT
"""Hydraulic actuators: clutch pressure as a response to the pressure command of the TCU.

`Actuator` is linear between the corners of its command. `ControlledActuator` takes the command of a
controller task and answers by the model that is identified from logs.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import apply_lag
from drivetwin.actuator.model import ActuatorModel, HeldSignal
from drivetwin.errors import InputError, Where

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Program:
    """A quantity over time, linear between `knots` (time [s], value SI), constant outside.

    Raises InputError where there is no knot or times do not increase.
    """

    knots: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        times = [time for time, _ in self.knots]
        if not times or any(b <= a for a, b in pairwise(times)):
            raise InputError(
                f"the knots of a program are at {times}",
                "give at least one knot, with increasing times",
                Where(key="knots"),
            )

    def evaluate(self, time: FloatArray) -> FloatArray:
        """Values at `time` (n,) [s]."""
        knots = np.array(self.knots)
        return np.asarray(np.interp(time, knots[:, 0], knots[:, 1]), dtype=np.float64)


@dataclass(frozen=True)
class Vibration:
    """Oscillation of the valve: `amplitude` [Pa], `frequency` [Hz], from `start` to `end` [s].

    Both edges are raised cosines one period long, so that the pressure has no step.
    """

    amplitude: float
    frequency: float
    start: float
    end: float

    def evaluate(self, time: FloatArray) -> FloatArray:
        """Pressure to add at `time` (n,) [s], in Pa."""
        edge = np.minimum(time - self.start, self.end - time) * self.frequency
        envelope = 0.5 - 0.5 * np.cos(np.pi * np.clip(edge, 0.0, 1.0))
        phase = 2.0 * np.pi * self.frequency * (time - self.start)
        return np.asarray(self.amplitude * envelope * np.sin(phase), dtype=np.float64)


@dataclass(frozen=True)
class Fill:
    """The stroke of a clutch piston against its return spring.

    While the piston moves, its pressure is at most `spring` [Pa]. The whole stroke takes `time` [s]
    at a pressure of `boost` [Pa], in proportion to the root of the pressure difference.
    """

    spring: float
    boost: float
    time: float

    def apply_fill(self, command: FloatArray, step: float) -> FloatArray:
        """Return what is left of `command` (n,) [Pa], sampled every `step` [s].

        A clutch that is commanded below the spring pressure at first is empty.
        """
        over = (command - self.spring) / (self.boost - self.spring)
        speed = np.sign(over) * np.sqrt(np.abs(over)) / self.time
        filled = 1.0 if command[0] > self.spring else 0.0
        allowed = command.copy()
        for index in range(1, command.size):
            filled = min(1.0, max(0.0, filled + step * speed[index]))
            if filled < 1.0:
                allowed[index] = min(command[index], self.spring)
        return allowed


@dataclass(frozen=True)
class Actuator:
    """Valve and clutch volume: a dead time, the fill, a first-order lag (times in s, lag > 0).

    `command` is the pressure asked for [Pa]; `vibration` is the unwanted part, as in the inertia
    phase of Fig. 4. Without `fill` the piston is at its stop. Raises InputError for other times.
    """

    command: Program
    dead_time: float
    lag: float
    vibration: Vibration | None = None
    fill: Fill | None = None

    def __post_init__(self) -> None:
        if not (self.dead_time >= 0.0 and self.lag > 0.0):
            raise InputError(
                f"a dead time of {self.dead_time:g} s and a lag of {self.lag:g} s",
                "give a dead time from 0 on and a lag above 0",
                Where(key="actuator"),
            )

    def compute_pressure(self, time: FloatArray) -> FloatArray:
        """Pressure at evenly spaced `time` (n,) [s], in Pa; at rest before `time[0]`."""
        command = self.command.evaluate(time - self.dead_time)
        step = float(time[1] - time[0])
        if self.fill is not None:
            command = self.fill.apply_fill(command, step)
        pressure = apply_lag(command, step, self.lag)
        if self.vibration is not None:
            pressure = pressure + self.vibration.evaluate(time)
        return np.asarray(pressure, dtype=np.float64)


@dataclass(frozen=True)
class ControlledActuator:
    """Actuator behind a controller that holds its command [Pa] for `task` [s].

    `resolution` [Pa] is that of the command. Raises InputError for a task that is not above 0.
    """

    command: Program
    model: ActuatorModel
    task: float = 0.01
    resolution: float = 1e3

    def __post_init__(self) -> None:
        if not self.task > 0.0:
            raise InputError(
                f"a controller task of {self.task:g} s",
                "give a time above 0",
                Where(key="actuator"),
            )

    def compute_command(self, duration: float) -> HeldSignal:
        """Return the command of all tasks up to `duration` [s]."""
        count = int(np.ceil(duration / self.task)) + 1
        time = self.task * np.arange(count, dtype=np.float64)
        values = self.resolution * np.round(self.command.evaluate(time) / self.resolution)
        return HeldSignal(time, np.asarray(values, dtype=np.float64))

    def compute_pressure(self, time: FloatArray) -> FloatArray:
        """Pressure at `time` (n,) [s], in Pa; at rest before the first command."""
        return self.model.compute_pressure(self.compute_command(float(time[-1])), time)
