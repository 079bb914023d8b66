# SPDX-License-Identifier: MIT
"""Clutch pressures of a log from its commands, through the actuators of a twin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.actuator.held_signal import HeldSignal
from drivetwin.actuator.model import ActuatorModel
from drivetwin.channels.pressure_roles import make_command_role, make_pressure_role
from drivetwin.channels.shiftlog import Channel, Quantity, ShiftLog
from drivetwin.errors import MissingChannelError, MissingParameterError, Where
from drivetwin.twin.twin import Twin

_STEP = 1e-3
"""Sampling step [s] of the calculated pressures; between samples they are linear."""


def replace_pressures(twin: Twin, log: ShiftLog) -> tuple[ShiftLog, tuple[str, ...]]:
    """Return the log with the pressures that follow from its commands, and their elements.

    Pressures of other elements stay as measured. Raises MissingParameterError where the twin has no
    actuator, and MissingChannelError where the log has no command to any of them.
    """
    if not twin.actuators:
        raise MissingParameterError(
            "the twin has no model of an actuator",
            "identify from a log with commanded and measured pressure (role "
            "pressure_command.<element>), or state [elements.<name>.actuator] on the vehicle card",
            Where(file=twin.name),
        )
    made = {
        name: _compute_channel(log[make_command_role(name)], one.model, name)
        for name, one in twin.actuators.items()
        if make_command_role(name) in log
    }
    if not made:
        roles = ", ".join(map(make_command_role, twin.actuators))
        raise MissingChannelError(
            f"the log has no commanded pressure: none of {roles}",
            "name the columns in a channel mapping file (--channels)",
            Where(file=log.source),
        )
    pressures = {make_pressure_role(name): channel for name, channel in made.items()}
    return replace(log, channels={**log.channels, **pressures}), tuple(made)


def _compute_channel(command: Channel, model: ActuatorModel, element: str) -> Channel:
    known = np.isfinite(command.values)
    held = HeldSignal(command.time[known], command.values[known])
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
