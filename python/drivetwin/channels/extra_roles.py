# SPDX-License-Identifier: MIT
"""Roles of channels beside those of a shift: electric motor, torques of shafts, temperatures.

They are optional: no command requires them, and a damaged one is left out with a finding.
"""

from __future__ import annotations

from drivetwin.channels.shiftlog import Quantity

EXTRA_ROLES = {"motor_torque": Quantity.TORQUE, "motor_speed": Quantity.SPEED}
"""Roles that exist once."""

PLACED_ROLES = {"shaft_torque": Quantity.TORQUE, "temperature": Quantity.TEMPERATURE}
"""Roles that exist once for each shaft or place: `shaft_torque.halfshaft`, `temperature.oil`."""


def get_place(role: str) -> str | None:
    """Return the shaft or place of a role such as `temperature.oil`; None for another role."""
    kind, _, place = role.partition(".")
    return place if kind in PLACED_ROLES and place else None


def get_extra_quantity(role: str) -> Quantity | None:
    """Return the quantity of an extra role; None for a role that is none."""
    if get_place(role) is not None:
        return PLACED_ROLES[role.partition(".")[0]]
    return EXTRA_ROLES.get(role)


def is_extra(role: str) -> bool:
    """Return True for an extra role."""
    return get_extra_quantity(role) is not None
