# SPDX-License-Identifier: MIT
"""The torque converter by its steady-state map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin.simulation.dual_clutch import FloatArray


@dataclass(frozen=True)
class Converter:
    """Steady-state map over ν = ω_turbine/ω_pump: `capacity` [N m s^2/rad^2] and torque ratio."""

    speed_ratio: tuple[float, ...]
    capacity: tuple[float, ...]
    torque_ratio: tuple[float, ...]

    def compute_pump_torque(
        self, pump: FloatArray | float, turbine: FloatArray | float
    ) -> FloatArray:
        """Torque that the pump takes [N m] at speeds of pump and turbine [rad/s], pump > 0."""
        capacity = np.interp(np.divide(turbine, pump), self.speed_ratio, self.capacity)
        return np.asarray(capacity * np.square(pump), dtype=np.float64)

    def compute_torque_ratio(
        self, pump: FloatArray | float, turbine: FloatArray | float
    ) -> FloatArray:
        """Turbine torque over pump torque."""
        ratio = np.interp(np.divide(turbine, pump), self.speed_ratio, self.torque_ratio)
        return np.asarray(ratio, dtype=np.float64)

    def compute_turbine_torque(
        self, pump: FloatArray | float, turbine: FloatArray | float
    ) -> FloatArray:
        """Torque that the turbine gives [N m] at speeds of pump and turbine [rad/s], pump > 0."""
        return self.compute_torque_ratio(pump, turbine) * self.compute_pump_torque(pump, turbine)

    def compute_turbine_slopes(
        self, pump: FloatArray, turbine: FloatArray, steps: tuple[float, float]
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives of the turbine's torque (n,) [N m s/rad] by the speeds of pump and turbine.

        As secants over ± `steps` [rad/s] of either speed, so that at a corner of the map the mean
        of both sides counts.
        """
        of_pump = np.minimum(steps[0], 0.5 * pump)
        of_turbine = np.full_like(turbine, steps[1])
        by_pump = self.compute_turbine_torque(
            pump + of_pump, turbine
        ) - self.compute_turbine_torque(pump - of_pump, turbine)
        by_turbine = self.compute_turbine_torque(
            pump, turbine + of_turbine
        ) - self.compute_turbine_torque(pump, turbine - of_turbine)
        return by_pump / (2.0 * of_pump), by_turbine / (2.0 * of_turbine)
