# SPDX-License-Identifier: MIT
"""Direction and power state of a shift."""

from __future__ import annotations

import numpy as np

from drivetwin.logs.shiftlog import ShiftLog
from drivetwin.shifts.shift import ShiftKind

_WINDOW = 0.3
"""Span before break-away [s] that decides the power state."""
_PEDAL = 0.05
"""Least accelerator position that counts as power on."""


def shift_kind(log: ShiftLog, up: bool, break_away: float) -> tuple[ShiftKind, tuple[str, ...]]:
    """Kind of the shift, and a warning where no channel tells the power state.

    Power is on where the mean engine torque in the last 0.3 s before break-away [s] is positive;
    in its absence the output torque's sign or the accelerator (above 5 %) decides.
    """
    limits = {"engine_torque": 0.0, "output_torque": 0.0, "throttle": _PEDAL}
    warnings: tuple[str, ...] = ()
    for role, limit in limits.items():
        if role in log:
            mean = _mean(log, role, break_away)
            if np.isfinite(mean):
                power_on = mean > limit
                break
    else:
        power_on = True
        warnings = ("no torque or pedal channel tells the power state: taken as power on",)
    if up:
        return (ShiftKind.POWER_ON_UP if power_on else ShiftKind.POWER_OFF_UP), warnings
    return (ShiftKind.POWER_ON_DOWN if power_on else ShiftKind.POWER_OFF_DOWN), warnings


def _mean(log: ShiftLog, role: str, end: float) -> float:
    channel = log[role]
    grid = np.linspace(end - _WINDOW, end, 31)
    values = channel.at(grid)
    values = values[np.isfinite(values)]
    return float(values.mean()) if len(values) else float("nan")
