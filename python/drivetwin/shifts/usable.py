# SPDX-License-Identifier: MIT
"""The shifts of a log that must hold one."""

from __future__ import annotations

from drivetwin.errors import NoShiftError, Where
from drivetwin.logs.shiftlog import ShiftLog
from drivetwin.shifts.find import FoundShifts, find_shifts
from drivetwin.vehicle.spec import VehicleCard


def usable_shifts(log: ShiftLog, card: VehicleCard) -> FoundShifts:
    """What `find_shifts` finds; NoShiftError lists what was refused where nothing can be used."""
    found = find_shifts(log, card)
    if found.shifts:
        return found
    reasons = "; ".join(
        f"{one.time[0]:.3f} s to {one.time[1]:.3f} s: {one.reason}" for one in found.rejected
    )
    raise NoShiftError(
        f"no usable gear shift; {reasons}" if reasons else "no gear shift: one gear throughout",
        "record from a second before the torque phase to a second after lock-up; "
        "check the ratios on the card and the speed channels with `drivetwin inspect`",
        Where(file=log.source),
    )
