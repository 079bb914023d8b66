# SPDX-License-Identifier: MIT
"""The closed set of channel roles: what a channel is to the driveline, and its quantity."""

from __future__ import annotations

from drivetwin.channels.extra_roles import get_extra_quantity
from drivetwin.channels.pressure_roles import get_element
from drivetwin.channels.shiftlog import Quantity

ROLES: dict[str, Quantity] = {
    "engine_torque": Quantity.TORQUE,
    "output_torque": Quantity.TORQUE,
    "input_speed": Quantity.SPEED,
    "engine_speed": Quantity.SPEED,
    "output_speed": Quantity.SPEED,
    "wheel_speed": Quantity.SPEED,
    "throttle": Quantity.FRACTION,
    "gear": Quantity.STATE,
    "requested_gear": Quantity.STATE,
    "shift_in_process": Quantity.STATE,
    "lockup_engaged": Quantity.STATE,
}
"""Roles that exist once; each shift element also has a pressure and a command, and
`drivetwin.channels.extra_roles` has those of other sensors."""

NEEDED = ("engine_torque", "output_torque", "input_speed", "output_speed", "wheel_speed")
"""Roles without which a log cannot be identified in absolute terms (pressures come on top)."""

FOR_SHIFTS = ("input_speed", "output_speed")
"""Roles without which no shift can be found."""

STAND_INS = {"input_speed": "engine_speed", "output_speed": "wheel_speed"}
"""Roles that another may replace, for finding shifts."""

AUXILIARY = frozenset((Quantity.FRACTION, Quantity.STATE))
"""Quantities that help where they are there: pedal, gear, flags. No result needs them."""

MEASURED = frozenset(role for role in ROLES if ROLES[role] in (Quantity.TORQUE, Quantity.SPEED))
"""Roles for which two candidate columns are an error even where the role is not needed."""


def get_quantity(role: str) -> Quantity:
    """Return the quantity of a role; raises KeyError for a role that does not exist."""
    extra = get_extra_quantity(role)
    if extra is not None:
        return extra
    return ROLES[role] if get_element(role) is None else Quantity.PRESSURE
