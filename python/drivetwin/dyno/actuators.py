# SPDX-License-Identifier: MIT
"""Hydraulic actuators: what pressure a clutch sees when the TCU asks for one."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import signal

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

    def at(self, time: FloatArray) -> FloatArray:
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

    def at(self, time: FloatArray) -> FloatArray:
        """Pressure to add at `time` (n,) [s], in Pa."""
        edge = np.minimum(time - self.start, self.end - time) * self.frequency
        envelope = 0.5 - 0.5 * np.cos(np.pi * np.clip(edge, 0.0, 1.0))
        phase = 2.0 * np.pi * self.frequency * (time - self.start)
        return np.asarray(self.amplitude * envelope * np.sin(phase), dtype=np.float64)


@dataclass(frozen=True)
class Actuator:
    """Valve and clutch volume: a dead time, then a first-order lag (both in s, lag > 0).

    `command` is the pressure asked for [Pa]; `vibration` is the unwanted part, as in the inertia
    phase of Fig. 4.
    """

    command: Program
    dead_time: float
    lag: float
    vibration: Vibration | None = None

    def pressure(self, time: FloatArray) -> FloatArray:
        """Pressure at evenly spaced `time` (n,) [s], in Pa; at rest before `time[0]`.

        The lag is solved exactly for a command that is linear between the samples.
        """
        command = self.command.at(time - self.dead_time)
        step = float(time[1] - time[0])
        decay = np.exp(-step / self.lag)
        mean = self.lag / step * (1.0 - decay)
        b, a = np.array([1.0 - mean, mean - decay]), np.array([1.0, -decay])
        pressure, _ = signal.lfilter(b, a, command, zi=signal.lfilter_zi(b, a) * command[0])
        if self.vibration is not None:
            pressure = pressure + self.vibration.at(time)
        return np.asarray(pressure, dtype=np.float64)
