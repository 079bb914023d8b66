# SPDX-License-Identifier: MIT
"""Policies by name, with the words for them; the command line imports them before NumPy."""

from __future__ import annotations

from enum import StrEnum
from typing import Self


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
