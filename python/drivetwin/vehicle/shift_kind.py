# SPDX-License-Identifier: MIT
"""Kinds of gear shifts: direction and power state."""

from __future__ import annotations

from enum import StrEnum


class ShiftKind(StrEnum):
    """Direction and power state of a shift."""

    POWER_ON_UP = "power-on upshift"
    POWER_OFF_UP = "power-off upshift"
    POWER_ON_DOWN = "power-on downshift"
    POWER_OFF_DOWN = "power-off downshift"
    POWER_UNKNOWN_UP = "upshift, power unknown"
    POWER_UNKNOWN_DOWN = "downshift, power unknown"

    @classmethod
    def from_direction(cls, *, up: bool, power_on: bool | None) -> ShiftKind:
        """Return the kind of an upshift, or downshift, with the power on, off or (None) unknown."""
        if power_on is None:
            return cls.POWER_UNKNOWN_UP if up else cls.POWER_UNKNOWN_DOWN
        if up:
            return cls.POWER_ON_UP if power_on else cls.POWER_OFF_UP
        return cls.POWER_ON_DOWN if power_on else cls.POWER_OFF_DOWN

    @property
    def is_up(self) -> bool:
        """True for an upshift."""
        return self in (
            ShiftKind.POWER_ON_UP,
            ShiftKind.POWER_OFF_UP,
            ShiftKind.POWER_UNKNOWN_UP,
        )

    @property
    def has_torque_phase_first(self) -> bool:
        """True where the on-coming element takes over the torque before the speeds change.

        Shifts of unknown power count as those with the power on.
        """
        return self in (
            ShiftKind.POWER_ON_UP,
            ShiftKind.POWER_OFF_DOWN,
            ShiftKind.POWER_UNKNOWN_UP,
        )
