# SPDX-License-Identifier: MIT
"""Surroundings of a gearbox in a shift: engine, output shaft, vehicle, and shift durations."""

from __future__ import annotations

from dataclasses import dataclass

from drivetwin.simulation.driveline import OutputSide
from drivetwin.simulation.dual_clutch import RoadLoad


@dataclass(frozen=True)
class Drive:
    """Engine and vehicle around a gearbox, and how it is shifted.

    Inertias [kg m^2]: `engine_inertia` joins the gearbox input, `vehicle_inertia` is at the wheel.
    `engine_torque` drives up-shifts, `overrun_torque` (negative) brakes in down-shifts [N m];
    `engine_speed` [rad/s] at the start; `shaft_stiffness` [N m/rad] and `shaft_damping`
    [N m s/rad] of the output shaft; `load_torque` at the wheel against forward motion [N m]. Times
    [s] of the torque and inertia phases.
    """

    engine_inertia: float
    engine_torque: float
    overrun_torque: float
    engine_speed: float
    final_drive: float
    vehicle_inertia: float
    shaft_stiffness: float
    shaft_damping: float
    load_torque: float
    torque_phase: float
    inertia_phase: float

    def build_output_side(self, load: RoadLoad) -> OutputSide:
        """Build the output side with a load at the wheel."""
        return OutputSide(
            self.shaft_stiffness, self.shaft_damping, self.final_drive, self.vehicle_inertia, load
        )
