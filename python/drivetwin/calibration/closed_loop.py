# SPDX-License-Identifier: MIT
"""Control of a shift: given profiles, or a controller with a closed slip loop behind actuators."""

from __future__ import annotations

from dataclasses import dataclass

from drivetwin.calibration.maneuver import Maneuver
from drivetwin.calibration.profiles import Profiles
from drivetwin.errors import SimulationError
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.shift_control import (
    INPUTS,
    ControlledNetwork,
    ControlledUnit,
    ShiftController,
    simulate_network_controlled,
)


@dataclass(frozen=True)
class ClosedLoop:
    """Controller, and the actuators of the nominal unit."""

    controller: ShiftController
    unit: ControlledUnit


Control = Profiles | ClosedLoop
"""Control of a shift."""


def compute_nominal_profiles(maneuver: Maneuver, control: Control) -> Profiles:
    """Return engine torque and pressures at the clutches of the nominal driveline.

    Raises SimulationError where its run fails.
    """
    if isinstance(control, Profiles):
        return control
    start = maneuver.start
    plant = ControlledNetwork(maneuver.elements, start, [control.unit], {})
    batch = simulate_network_controlled(
        plant, [control.controller], maneuver.time, [maneuver.body.drive], with_inputs=True
    )
    if batch.failed:
        raise SimulationError(
            f"the shift of the nominal driveline failed: {batch.failed[0]}",
            "give another start of the policy, or another operating point",
        )
    columns = dict(zip(INPUTS, batch.inputs[0, 0], strict=True))
    return Profiles(
        engine_torque=Signal(maneuver.time, columns["engine_torque"]),
        offgoing=Signal(maneuver.time, columns["pressure.offgoing"]),
        oncoming=Signal(maneuver.time, columns["pressure.oncoming"]),
    )
