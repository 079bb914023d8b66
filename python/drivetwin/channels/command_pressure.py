# SPDX-License-Identifier: MIT
"""Clutch pressures that are computed from their commands."""

from __future__ import annotations

import numpy as np

from drivetwin.actuator.held_signal import HeldSignal
from drivetwin.actuator.model import ActuatorModel
from drivetwin.channels.pressure_roles import make_pressure_role
from drivetwin.channels.shiftlog import Channel, Quantity

_STEP = 1e-3
"""Sampling step [s] of the calculated pressures; between samples they are linear."""


def get_held_command(command: Channel) -> HeldSignal:
    """Return the finite values of a commanded pressure, each held until the next."""
    known = np.isfinite(command.values)
    return HeldSignal(command.time[known], command.values[known])


def compute_pressure_channel(command: Channel, model: ActuatorModel, element: str) -> Channel:
    """Pressure of a clutch over the time of its command, by the model of its actuator."""
    held = get_held_command(command)
    first, last = float(held.time[0]), float(held.time[-1])
    count = int((last - first) / _STEP + 1e-6) + 1
    time = first + _STEP * np.arange(count, dtype=np.float64)
    return Channel(
        make_pressure_role(element),
        Quantity.PRESSURE,
        time,
        model.compute_pressure(held, time),
        command.source_name,
        command.source_unit,
    )
