# SPDX-License-Identifier: MIT
"""Inputs of a network that are functions of unknowns: actuators, lagged messages, ramps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.constants import bar

from drivetwin._util.arrays import FloatArray
from drivetwin.actuator.model import QUANTITIES, ActuatorModel, HeldSignal


@dataclass(frozen=True, eq=False)
class InputPath:
    """Input as a function of the unknowns `of`: `compute` of their values returns it (N,) on the
    grid of the run."""

    of: tuple[str, ...]
    compute: Callable[..., FloatArray]


@dataclass(frozen=True, eq=False)
class CommandedClutch:
    """Excess of the clutch pressure over P0 by a command: actuator and temperature of a recording.

    The command passes the play of the valve, the dead time, the fill and the lag, see
    `drivetwin.actuator.model`. The friction force is curved: x = μ(Θ)·(p - P0)·(1 + b·(p - P0)).
    `warmth` is the oil temperature beyond its reference [K].
    """

    command: HeldSignal
    time: FloatArray
    warmth: float

    def compute(self, values: Mapping[str, float]) -> FloatArray:
        """Compute x (N,) [Pa]; pressures in `values` are in bar, times in s.

        `spring` is the mean pressure of the return spring over P0 while the clutch is filled.
        """
        kiss = max(values["P0"] * (1.0 - values["P0_temperature"] * self.warmth), _LEAST_KISS)
        fluidity = np.exp(np.clip(values["fill_temperature"] * self.warmth, -2.0, 2.0))
        lag = 0.5 * values["lag"]
        numbers = {
            "dead_time": values["dead_time"],
            "rising_lag": lag,
            "falling_lag": lag,
            "damping": 1.0,
            "kiss_pressure": values["spring"] * kiss * bar,
            "fill_time": values["fill_time"] / fluidity,
            "hysteresis": values["hysteresis"] * bar,
        }
        clipped = {
            name: min(max(value, QUANTITIES[name].lower), QUANTITIES[name].upper)
            for name, value in numbers.items()
        }
        pressure = ActuatorModel(**clipped).compute_pressure(self.command, self.time) / bar
        excess = pressure - kiss
        friction = 1.0 - values["friction_temperature"] * self.warmth
        bent = 1.0 + values["curve"] * np.clip(excess, 0.0, None)
        return np.asarray(friction * bar * excess * bent)


_LEAST_KISS = 0.05
"""Least P0 [bar]: a clutch without return spring has none."""


def lag_signal(time: FloatArray, values: FloatArray, lag: float) -> FloatArray:
    """Compute a first-order lag (N,) of a signal on an even grid `time` (N,) [s], linear between
    its points and at rest before them."""
    from scipy.signal import lfilter  # loading takes 0.2 s, and most commands do without it

    step = float(time[1] - time[0])
    fall = np.exp(-step / lag)
    share = lag / step * (1.0 - fall)
    begin = [share * values[0]]
    found, _ = lfilter([1.0 - share, share - fall], [1.0, -fall], values, zi=begin)
    return np.asarray(found)
