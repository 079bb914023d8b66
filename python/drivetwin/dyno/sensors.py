# SPDX-License-Identifier: MIT
"""Sensors and the CAN bus: from exact trajectories to recorded channels, with sensor effects."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin.channels.shiftlog import Channel, Quantity
from drivetwin.dyno.effects import SENSOR_EFFECTS, Effects
from drivetwin.dyno.random_walk import WalkStream, draw_walk
from drivetwin.errors import InputError, Where
from drivetwin.simulation.dual_clutch import FloatArray
from drivetwin.vehicle.effects import EffectId

LOOKS = 20
"""Instants per averaging window; the error of the mean falls with their square."""


@dataclass(frozen=True)
class Sensor:
    """One channel of the log.

    `column` and `unit` are those of the file; everything else is SI. A sample is the quantity at
    its time stamp minus `delay` [s], plus white noise of `noise` (1 σ), rounded to a multiple of
    `resolution` (0: not rounded). `rate` in Hz; a rate below the logger's gives held values.
    """

    role: str
    quantity: Quantity
    column: str
    unit: str
    rate: float
    noise: float
    resolution: float = 0.0
    delay: float = 0.0
    window: float = 0.0
    """Time [s] before the stamp over which a sample is the mean, as encoders on a bus send it."""

    def compute_instants(self, stamps: FloatArray) -> FloatArray:
        """Instants (n, m) [s] that each sample averages; none before 0."""
        if self.window == 0.0:
            before = np.zeros(1)
        else:
            before = self.window * (np.arange(LOOKS) + 0.5) / LOOKS
        return np.maximum(stamps[:, None] - self.delay - before, 0.0)

    def compute_stamps(self, duration: float) -> FloatArray:
        """Time stamps (n,) [s] from 0 to `duration`, exact multiples of the period."""
        return np.arange(int(np.floor(duration * self.rate + 1e-9)) + 1) / self.rate

    def read(
        self, stamps: FloatArray, exact: FloatArray, noise: float, rng: np.random.Generator
    ) -> Channel:
        """The recorded channel from the `exact` quantity (n,) at `stamps - delay`.

        `noise` scales the white noise; at 0 the sensor is ideal and does not round either.
        """
        values = exact + noise * self.noise * rng.standard_normal(exact.size)
        if noise > 0.0 and self.resolution > 0.0:
            values = self.resolution * np.round(values / self.resolution)
        return Channel(self.role, self.quantity, stamps, values, self.column, self.unit)


_ROLE = "output_torque"
_DRIFT_TIME = 5.0
"""Time [s] after which the standard deviation of a drift is stated."""


def apply_delay(sensors: tuple[Sensor, ...], effects: Effects) -> tuple[Sensor, ...]:
    """Return the sensors with an output torque that is older by the effect.

    Raises InputError for an effect in a sensor that is absent.
    """
    wanted = [name for name in SENSOR_EFFECTS if effects.get(name, 0.0) > 0.0]
    if wanted and _ROLE not in [sensor.role for sensor in sensors]:
        raise InputError(
            f"{', '.join(sorted(wanted))}: the scenario records no output torque",
            "choose a scenario with an output torque sensor",
            Where(key="effect"),
        )
    late = effects.get(EffectId.OUTPUT_TORQUE_DELAY, 0.0)
    return tuple(
        replace(sensor, delay=sensor.delay + late) if sensor.role == _ROLE else sensor
        for sensor in sensors
    )


@dataclass(frozen=True)
class TorqueError:
    """Error of the output torque sensor: offset, and its drift after 5 s (1 σ) [N m]."""

    offset: float
    drift: float
    seed: int
    duration: float

    def compute(self, role: str, stamps: FloatArray) -> FloatArray:
        """Error (n,) [N m] of a channel at its `stamps` (n,) [s]; 0 for other roles."""
        error = np.zeros_like(stamps)
        if role != _ROLE:
            return error
        if self.drift > 0.0:
            walk = draw_walk(WalkStream.OUTPUT_TORQUE, self.seed, self.duration)
            scale = self.drift / np.sqrt(_DRIFT_TIME)
            error += scale * np.interp(stamps, walk.time, walk.values)
        return error + self.offset


def compute_torque_error(effects: Effects, full: float, seed: int, duration: float) -> TorqueError:
    """Compute the error of the sensor; `full` is the largest shaft torque [N m]."""
    return TorqueError(
        full * effects.get(EffectId.OUTPUT_TORQUE_OFFSET, 0.0),
        full * effects.get(EffectId.OUTPUT_TORQUE_DRIFT, 0.0),
        seed,
        duration,
    )
