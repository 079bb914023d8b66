# SPDX-License-Identifier: MIT
"""Policy of the user's own controller: parameters and tables of a C step function."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.maneuver import ClosedLoop, Maneuver
from drivetwin.calibration.policy import Policy, PolicyParameter
from drivetwin.simulation.shift_control import ControlledUnit, ExternalController

HEADER = Path(__file__).with_name("drivetwin_controller.h")
"""Interface of the step function, for the compiler."""
BENCH = Path(__file__).with_name("drivetwin_bench.c")
"""Test bench around the step function, compiled with it."""
BENCH_DEFINES = ("dt_step=dt_user_step", "dt_state_size=dt_user_state_size")
"""Names that the bench gives to the functions of the controller."""


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
class OwnPolicy(Policy):
    """Controllers by the values of their parameters; `unit` are the nominal actuators."""

    given: UserController
    base: ExternalController
    unit: ControlledUnit

    def build_control(self, values: FloatArray) -> ClosedLoop:
        """Return the controller of values (p,) in the units of the parameter file."""
        numbers = self.given.fill(values.tolist())
        return ClosedLoop(replace(self.base, parameters=numbers), self.unit)


def build_own_policy(
    maneuver: Maneuver, system_pressure: float, unit: ControlledUnit, given: UserController
) -> OwnPolicy:
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
    return OwnPolicy(given.parameters, given, base, unit)
