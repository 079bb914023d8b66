# SPDX-License-Identifier: MIT
"""Pressures of the two elements of a shift, also where one clutch serves both gears.

In a manual gearbox the clutch opens, the other gear is engaged, and it closes again: one pressure,
mapped to two elements of the card. It belongs to the off-going element until the clutch is open,
and to the on-coming one from then on.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.channels.pressure_roles import make_pressure_role
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.shifts.shift import Shift


def is_shared_pressure(log: ShiftLog, offgoing: str, oncoming: str) -> bool:
    """Return True if the pressures of both elements come from the same column."""
    roles = (make_pressure_role(offgoing), make_pressure_role(oncoming))
    if any(role not in log for role in roles):
        return False
    first, second = (log[role] for role in roles)
    same = first.source_name == second.source_name and first.time.size == second.time.size
    return same and bool(np.array_equal(first.values, second.values))


def get_shift_pressures(log: ShiftLog, shift: Shift) -> dict[str, Channel]:
    """Pressure channels of both elements of a shift, by name.

    Raises MissingChannelError where one is missing.
    """
    found = {name: log.get_pressure(name) for name in (shift.offgoing, shift.oncoming)}
    if not is_shared_pressure(log, shift.offgoing, shift.oncoming):
        return found
    channel = found[shift.offgoing]
    open_ = _estimate_opening_time(channel, shift.inertia_phase)
    before = channel.time <= open_
    return {
        shift.offgoing: replace(channel, values=np.where(before, channel.values, 0.0)),
        shift.oncoming: replace(
            channel,
            role=make_pressure_role(shift.oncoming),
            values=np.where(before, 0.0, channel.values),
        ),
    }


def _estimate_opening_time(channel: Channel, phase: tuple[float, float]) -> float:
    """Instant [s] in the middle of the time in which the pressure is least."""
    inside = (channel.time >= phase[0]) & (channel.time <= phase[1])
    time, values = channel.time[inside], channel.values[inside]
    level = float(np.min(values)) + 0.05 * float(np.ptp(values))
    return float(np.median(time[values <= level]))
