# SPDX-License-Identifier: MIT
"""Policy of the user's own controller: parameters and tables of a C step function."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.closed_loop import ClosedLoop
from drivetwin.calibration.maneuver import Maneuver
from drivetwin.calibration.profiles import PolicyParameter, check_parameters, move_start
from drivetwin.simulation.shift_control import ControlledUnit, ExternalController


@dataclass(frozen=True)
class UserController:
    """Compiled controller with the numbers of its parameter file, and its task [s].

    `numbers` (n,) are those that the step function reads, the breakpoints of tables among them;
    `places` (p,) are the places of the parameters, of which each value of a table is one.
    `oil_temperature` [K] is an input of the controller.
    """

    library: Path
    parameters: tuple[PolicyParameter, ...]
    numbers: tuple[float, ...]
    places: tuple[int, ...]
    task: float
    oil_temperature: float

    def fill(self, values: Iterable[float]) -> tuple[float, ...]:
        """Return the numbers (n,) with other values (p,) of the parameters."""
        numbers = list(self.numbers)
        for place, value in zip(self.places, values, strict=True):
            numbers[place] = value
        return tuple(numbers)


@dataclass(frozen=True)
class UserPolicy:
    """Controllers by the values of their parameters.

    `unit` are the actuators of the nominal unit.
    """

    parameters: tuple[PolicyParameter, ...]
    given: UserController
    base: ExternalController
    unit: ControlledUnit

    def __post_init__(self) -> None:
        check_parameters(self.parameters)

    def set_start(self, values: Mapping[str, float]) -> UserPolicy:
        """Return the policy with other starting values by name; see `move_start`."""
        return replace(self, parameters=move_start(self.parameters, values))

    def build_control(self, values: FloatArray) -> ClosedLoop:
        """Return the controller of values (p,) in the units of the parameter file."""
        return ClosedLoop(
            replace(self.base, parameters=self.given.fill(values.tolist())), self.unit
        )


def build_user_policy(
    maneuver: Maneuver, system_pressure: float, unit: ControlledUnit, given: UserController
) -> UserPolicy:
    """Return the policy of a shift; `system_pressure` [Pa] is that of a held element."""
    base = ExternalController(
        offgoing=maneuver.offgoing.name,
        oncoming=maneuver.oncoming.name,
        task=given.task,
        request=maneuver.request,
        engine_torque=maneuver.point.engine_torque,
        system_pressure=system_pressure,
        oil_temperature=given.oil_temperature,
        parameters=given.numbers,
        library=given.library,
    )
    return UserPolicy(given.parameters, given, base, unit)
