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
    `engine_speed` [rad/s] at the start; `i_f` final drive; shaft `k_o` [N m/rad],
    `c_o` [N m s/rad]; `load` at the wheel against forward motion [N m]. Times [s] of the torque
    and inertia phases.
    """

    engine_inertia: float
    engine_torque: float
    overrun_torque: float
    engine_speed: float
    i_f: float
    vehicle_inertia: float
    k_o: float
    c_o: float
    load: float
    torque_phase: float
    inertia_phase: float

    def build_output_side(self, load: RoadLoad) -> OutputSide:
        """Build the output side with a load at the wheel."""
        return OutputSide(self.k_o, self.c_o, self.i_f, self.vehicle_inertia, load)
