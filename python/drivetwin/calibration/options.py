# SPDX-License-Identifier: MIT
"""Policy, operating point and seed of a calibration, as command line and Python state them."""

from __future__ import annotations

from enum import StrEnum
from typing import Self

from drivetwin._util.request import BAR, CELSIUS, METRE, NM, RPM, SECOND, Request, option


class PolicyKind(StrEnum):
    """Policy of a calibration.

    `help` names its unknowns. `commands_actuators` is True where pressures of its parameters are
    commands, behind the actuators of the twin; else they are those at the clutches.
    """

    help: str
    commands_actuators: bool

    CONTROLLER = "controller", "controller parameters"
    KNOTS = "knots", "knots of the profiles"
    SLIP = "slip", "commands with a closed slip loop behind the actuators", True
    OWN = "own", "numbers of your own controller in C", True

    def __new__(cls, value: str, text: str = "", commands_actuators: bool = False) -> Self:
        """Make a member of its name on the command line and the words for it."""
        member = str.__new__(cls, value)
        member._value_ = value
        member.help = text
        member.commands_actuators = commands_actuators
        return member

    @property
    def pressures(self) -> str:
        """Place of the pressures of its parameters, in words."""
        return "commands of the controller" if self.commands_actuators else "those at the clutch"

    @classmethod
    def describe_all(cls) -> str:
        """Return the unknowns of all policies as words of one sentence."""
        *first, last = (one.help for one in cls)
        return f"{', '.join(first)}, or {last}"


USUAL_WHEEL_RADIUS = 0.5
"""Wheel radius [m] where neither request nor twin have one: a heavy truck. It scales all
accelerations alike."""


class ShiftOptions(Request):
    """Operating point (None: from the twin), hardware and seed of simulated shifts.

    `engine_torque` [N m] and `engine_speed` [rad/s] are those at the shift request. `engine_lag`
    [s] is that of the torque of a commanded engine. `system_pressure` [Pa] is by default the
    largest that the twin's log has; `wheel_radius` [m] is by default that of the twin, else
    `USUAL_WHEEL_RADIUS`.
    """

    engine_torque: float | None = option("Engine torque at the shift request.", unit=NM)
    engine_speed: float | None = option("Engine speed at the shift request.", unit=RPM)
    system_pressure: float | None = option(
        "Pressure of a held element.", unit=BAR, minimum=0.0, maximum=100.0
    )
    wheel_radius: float | None = option(
        f"Dynamic tyre radius; by default that of the vehicle card, else {USUAL_WHEEL_RADIUS}.",
        unit=METRE,
        minimum=0.05,
        maximum=2.0,
    )
    engine_lag: float = option(
        "Lag of the engine torque behind its command.",
        unit=SECOND,
        minimum=0.0,
        maximum=1.0,
        default=0.05,
    )
    seed: int = option("Seed of draws and search.", minimum=0, default=1)


class CalibrationOptions(ShiftOptions):
    """Operating point, policy, hardware and seed of a calibration.

    `oil_temperature` [K] is by default that of the twin's log, `task` [s] the time between two
    commands of a closed slip loop.
    """

    oil_temperature: float | None = option(
        "Oil temperature of the shift.", unit=CELSIUS, minimum=-40.0, maximum=180.0
    )
    policy: PolicyKind = option(
        f"Unknowns: {PolicyKind.describe_all()}.", default=PolicyKind.CONTROLLER
    )
    task: float = option(
        "Controller task (slip).", unit=SECOND, minimum=1e-3, maximum=0.1, default=0.01
    )
