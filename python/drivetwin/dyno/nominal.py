# SPDX-License-Identifier: MIT
"""The run without effects, to whose torques, speeds and friction work the effects are related."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.signal_processing import integrate_trapezoids
from drivetwin.simulation.dual_clutch import DualClutch, FloatArray, Signal, Trajectory

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
