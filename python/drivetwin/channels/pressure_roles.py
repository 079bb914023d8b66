# SPDX-License-Identifier: MIT
"""Roles of clutch and brake pressures: `pressure.<element>`, `pressure_command.<element>`."""

from __future__ import annotations

_PREFIX, _COMMAND = "pressure.", "pressure_command."


def make_pressure_role(element: str) -> str:
    """Return the role of the pressure of a clutch or brake by its name on the card."""
    return _PREFIX + element


def get_pressure_element(role: str) -> str | None:
    """Return the element whose pressure a role is; None for the role of another quantity."""
    return role.removeprefix(_PREFIX) if role.startswith(_PREFIX) else None


def make_command_role(element: str) -> str:
    """Return the role of the commanded pressure of a clutch or brake by its name on the card."""
    return _COMMAND + element


def get_command_element(role: str) -> str | None:
    """Return the element whose commanded pressure a role is; None for another role."""
    return role.removeprefix(_COMMAND) if role.startswith(_COMMAND) else None


def get_element(role: str) -> str | None:
    """Return the element whose pressure or commanded pressure a role is; None for another role."""
    element = get_pressure_element(role)
    return get_command_element(role) if element is None else element
