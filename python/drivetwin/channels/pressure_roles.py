# SPDX-License-Identifier: MIT
"""The role of a clutch or brake pressure: `pressure.<element>`, one for each shift element."""

from __future__ import annotations

_PREFIX = "pressure."


def make_pressure_role(element: str) -> str:
    """Return the role of the pressure of a clutch or brake by its name on the card."""
    return _PREFIX + element


def get_pressure_element(role: str) -> str | None:
    """Return the element whose pressure a role is; None for the role of another quantity."""
    return role.removeprefix(_PREFIX) if role.startswith(_PREFIX) else None
