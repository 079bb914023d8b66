# SPDX-License-Identifier: MIT
"""Sensors and the CAN bus: from exact trajectories to recorded channels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin.channels.shiftlog import Channel, Quantity
from drivetwin.simulation.dual_clutch import FloatArray

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
