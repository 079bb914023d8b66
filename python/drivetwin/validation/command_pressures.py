# SPDX-License-Identifier: MIT
"""Clutch pressures of a log from its commands, through the actuators of a twin."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.channels.roles import make_command_role, make_pressure_role
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import MissingChannelError, MissingParameterError, Where
from drivetwin.estimation.data.actuators import compute_pressure_channel
from drivetwin.twin.twin import Twin


def replace_pressures(twin: Twin, log: ShiftLog) -> tuple[ShiftLog, tuple[str, ...]]:
    """Return the log with the pressures that follow from its commands, and their elements.

    Pressures of other elements stay as measured. Raises MissingParameterError where the twin has no
    actuator, and MissingChannelError where the log has no command to any of them.
    """
    if not twin.actuators:
        raise MissingParameterError(
            "the twin has no model of an actuator",
            "identify from a log with commanded pressures (role "
            "pressure_command.<element>), or state [elements.<name>.actuator] on the vehicle card",
            Where(file=twin.name),
        )
    made = {
        name: compute_pressure_channel(log[make_command_role(name)], one.model, name)
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
