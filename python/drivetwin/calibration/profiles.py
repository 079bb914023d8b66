# SPDX-License-Identifier: MIT
"""Control of a shift: profiles of engine torque and pressures, or a controller behind actuators."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.maneuver import Maneuver
from drivetwin.errors import SimulationError
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.shift_control import (
    INPUTS,
    AnyController,
    ControlledUnit,
    simulate_network_controlled,
)


@dataclass(frozen=True, eq=False)
class Profiles:
    """Engine torque [N m] and pressures [Pa] at the clutches, linear between their corners."""

    engine_torque: Signal
    offgoing: Signal
    oncoming: Signal

    @property
    def signals(self) -> dict[str, Signal]:
        """Signals by name, as files and figures call them."""
        return {
            "engine_torque": self.engine_torque,
            "pressure.offgoing": self.offgoing,
            "pressure.oncoming": self.oncoming,
        }

    def sample(self, time: FloatArray) -> Profiles:
        """Return the profiles with corners at `time` (n,) [s] alone.

        The core passes samples of one distance with one operator; corners between them need their
        own in every run.
        """
        return Profiles(
            *(
                Signal(time, np.interp(time, one.arrival, one.values))
                for one in (self.engine_torque, self.offgoing, self.oncoming)
            )
        )


@dataclass(frozen=True)
class ClosedLoop:
    """Controller, and the actuators of the nominal unit."""

    controller: AnyController
    unit: ControlledUnit


Control = Profiles | ClosedLoop
"""Control of a shift."""


def compute_nominal_profiles(maneuver: Maneuver, control: Control) -> Profiles:
    """Return engine torque and pressures at the clutches of the nominal driveline.

    Raises SimulationError where its run fails.
    """
    if isinstance(control, Profiles):
        return control
    plant = maneuver.build_controlled([control.unit], {})
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
