# SPDX-License-Identifier: MIT
"""The shift to be calibrated: driveline, operating point, request, time grid, and its control.

The control is by profiles of engine torque and pressures, or by a controller behind actuators.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import InputError, SimulationError
from drivetwin.simulation.added_elements import NO_ADDED_ELEMENTS, AddedElements
from drivetwin.simulation.driveline import (
    CRANK,
    ENGINE,
    OUTPUT,
    VEHICLE,
    Driveline,
    VehicleBody,
    build_driveline,
    build_start,
    compute_twist,
    find_body,
)
from drivetwin.simulation.dual_clutch import DualClutch, ShiftElement, Signal, State
from drivetwin.simulation.network import Element, Start
from drivetwin.simulation.shift_control import (
    INPUTS,
    AnyController,
    ControlledNetwork,
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


@dataclass(frozen=True)
class OperatingPoint:
    """State at the request: engine torque [N m], engine speed [rad/s], oil temperature [K].

    An oil temperature of None is that of the twin's log.
    """

    engine_torque: float
    engine_speed: float
    oil_temperature: float | None = None


@dataclass(frozen=True, eq=False)
class Maneuver:
    """A shift of `model` from its first shift element to its second at an operating point.

    `wheel_radius` [m] converts the wheel's motion to the vehicle's. The gear is requested at
    `request` [s]; the run ends at `horizon` [s] and is sampled every `step` [s]. Pressures
    act `pressure_delay` [s] late. `added` are the elements beside the dual clutch.
    """

    model: DualClutch
    point: OperatingPoint
    wheel_radius: float
    request: float = 0.1
    horizon: float = 1.6
    step: float = 1e-3
    added: AddedElements = NO_ADDED_ELEMENTS
    pressure_delay: float = 0.0

    @cached_property
    def time(self) -> FloatArray:
        """Samples (n,) [s] of a run."""
        return self.step * np.arange(round(self.horizon / self.step) + 1, dtype=np.float64)

    @property
    def driveline(self) -> Driveline:
        """Nominal driveline."""
        return Driveline(self.model, self.added)

    @cached_property
    def elements(self) -> list[Element]:
        """Network of the nominal driveline."""
        return build_driveline(self.model, self.added)

    @cached_property
    def body(self) -> VehicleBody:
        """Inertia that moves with the vehicle."""
        return find_body(self.driveline)

    @property
    def offgoing(self) -> ShiftElement:
        """Element that holds the old gear."""
        return self.model.elements[0]

    @property
    def oncoming(self) -> ShiftElement:
        """Element that holds the new gear."""
        return self.model.elements[1]

    @property
    def ratios(self) -> tuple[float, float]:
        """Overall ratios ω_e/ω_out of the old and the new gear."""
        old, new = (self.model.get_overall_ratio(one.name) for one in self.model.elements)
        return old, new

    @property
    def direction(self) -> float:
        """Sign of the change of engine speed: -1 for an upshift, 1 for a downshift."""
        old, new = self.ratios
        return float(np.sign(abs(new) - abs(old)))

    @property
    def inertia_first(self) -> bool:
        """True where the engine itself moves its speed to that of the new gear.

        These are downshifts with the power on and upshifts with the power off.
        """
        return self.point.engine_torque * self.direction > 0.0

    def build_start(self, driveline: Driveline | None = None) -> State:
        """Return steady acceleration in the old gear, of another `driveline` if given."""
        driveline = driveline or self.driveline
        model = driveline.model
        ratio = self.ratios[0]
        output = self.point.engine_speed / ratio
        wheel = output / model.i_f
        torque = model.compute_steady_torque(self.point.engine_torque, ratio, wheel)
        speed = self.point.engine_speed
        twist = compute_twist(model, driveline.added, torque)
        return State(speed, output, wheel, twist, (self.offgoing.name,))

    @cached_property
    def start(self) -> Start:
        """Start of the nominal network."""
        return self.build_network_start(self.driveline)

    def build_network_start(self, driveline: Driveline) -> Start:
        """Return the start of the network of a driveline, with the nominal speeds of the gear."""
        state = replace(self.build_start(), twist=self.build_start(driveline).twist)
        held = Signal(self.time[:2], np.full(2, self.point.engine_torque))
        return build_start(driveline.model, driveline.added, state, held, 0.0)

    def build_controlled(
        self, units: Sequence[ControlledUnit], sets: Mapping[str, FloatArray]
    ) -> ControlledNetwork:
        """Return made units of the nominal network, with values (units,) of numbers by path."""
        engine = ENGINE if self.added.front is None else CRANK
        return ControlledNetwork(self.elements, self.start, units, sets, speeds=(engine, OUTPUT))

    def compute_acceleration(self, torque: float, ratio: float) -> float:
        """Steady acceleration of the output shaft [rad/s^2] at an engine torque [N m] in a gear."""
        model = self.model
        wheel = self.point.engine_speed / (self.ratios[0] * model.i_f)
        drive = model.eta * torque * ratio - model.load.evaluate(wheel) / model.i_f
        return drive / sum(model.compute_side_inertias(ratio))

    def linearise(self) -> Maneuver:
        """Return the shift with a tyre, if any, as a damper about the speed of its middle."""
        tyre = self.added.tyre
        if tyre is None:
            return self
        rate = self.compute_acceleration(self.point.engine_torque, self.ratios[0]) / self.model.i_f
        linear = tyre.linearise(self.start.speeds[VEHICLE] + 0.5 * self.horizon * rate)
        return replace(self, added=replace(self.added, tyre=linear.drop_fast_rim()))

    def set_step(self, step: float) -> Maneuver:
        """Return the shift with another sampling step [s]."""
        return replace(self, step=step)


def check_gears(maneuver: Maneuver) -> None:
    """Raise InputError where both gears of a shift have the same overall ratio."""
    if maneuver.direction == 0.0:
        raise InputError(
            "both gears of the shift have the same overall ratio", "choose two different gears"
        )
