# SPDX-License-Identifier: MIT
"""Effects in the output torque sensor."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin.dyno.effects import SENSOR_EFFECTS, Effects
from drivetwin.dyno.random_walk import WalkStream, draw_walk
from drivetwin.dyno.sensors import Sensor
from drivetwin.errors import InputError, Where
from drivetwin.simulation.dual_clutch import FloatArray
from drivetwin.vehicle.effects import EffectId

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
