# SPDX-License-Identifier: MIT
"""Commanded pressures in place of measured ones: recognition by steps, and their refusal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.channels.roles import get_pressure_element, make_command_role, make_pressure_role
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.channels.units import BAR
from drivetwin.errors import MissingChannelError, Where
from drivetwin.findings import Code, Finding, report

_STEP = 0.05
"""Least step of a command between two samples, over the range of the channel. Rounding to eight
bits makes steps of 0.004."""
_FLAT = 0.01
"""Largest change beside a step, over the step. A pressure settles for several samples."""
_CODES = 2.5
"""Least step of a command, over the smallest change of the channel. A rounded pressure moves by one
code at a time."""
_COARSEST = 0.2
"""Largest smallest change that is taken for rounding, over the range of the channel. No sensor has
five codes; commands have few levels."""
_RESTS = 0.5
"""Least share of samples that repeat the one before: a measured pressure has noise."""
_SLOWEST = 0.05
"""Longest sample interval [s] at which a pressure is seen to settle: a few lags of a valve."""
_FEWEST = 20
"""Fewest samples that show how a channel moves."""
_WITHOUT = (
    "Without them 'drivetwin identify --bus' estimates the quantities that speeds and engine "
    "torque determine; of an automatic with converter, 'drivetwin identify' takes the commands "
    "themselves with a card that has [[changes]], see 'drivetwin schema tcu-card'"
)
"""Remedy where no pressure was recorded."""


def find_command_step(channel: Channel) -> tuple[float, float, float] | None:
    """Return time [s], value before and value after [Pa] of the largest step of a command.

    None for a measured pressure, which has noise and settles over several samples.
    """
    fresh = channel.updates
    known = np.isfinite(fresh.values)
    time, values = fresh.time[known], fresh.values[known]
    if time.size < _FEWEST or np.median(np.diff(time)) > _SLOWEST or not _rests(values):
        return None
    sizes, extent = np.abs(np.diff(values)), float(np.ptp(values))
    code = float(np.min(sizes, where=sizes > 0.0, initial=np.inf))
    least = max(_STEP * extent, _CODES * code if code <= _COARSEST * extent else 0.0)
    beside = np.maximum(sizes[:-2], sizes[2:])
    alone = (sizes[1:-1] > least) & (beside < _FLAT * sizes[1:-1])
    if not alone.any():
        return None
    place = 1 + int(np.argmax(np.where(alone, sizes[1:-1], 0.0)))
    return float(time[place + 1]), float(values[place]), float(values[place + 1])


def _rests(values: FloatArray) -> bool:
    """Return True if most samples repeat the one before, as no measured pressure does."""
    return bool(np.mean(np.diff(values) == 0.0) >= _RESTS)


def check_commands(channels: Mapping[str, Channel]) -> list[Finding]:
    """Report each channel that is mapped as a pressure and steps like a command."""
    found = []
    for role, channel in channels.items():
        element = get_pressure_element(role)
        step = None if element is None else find_command_step(channel)
        if element is not None and step is not None:
            shown = {"before": step[1] / BAR, "after": step[2] / BAR, "time": step[0]}
            found.append(report(Code.PRESSURE_STEPS, "", channel.place, element=element, **shown))
    return found


def refuse_commands(log: ShiftLog, elements: Sequence[str]) -> None:
    """Raise MissingChannelError if the pressures of `elements` are commands.

    They are mapped as pressures but step like commands, or the log has commands alone.
    """
    named = [name for name in dict.fromkeys(elements) if make_pressure_role(name) in log]
    steps = {name: find_command_step(log[make_pressure_role(name)]) for name in named}
    stepping = {name: one for name, one in steps.items() if one is not None}
    where = Where(file=log.source)
    if stepping:
        name, (time, before, after) = next(iter(stepping.items()))
        pressures = {one: log[make_pressure_role(one)] for one in named}
        alike = [one for one in named if one in stepping or _rests(pressures[one].updates.values)]
        columns = ", ".join(repr(pressures[one].source_name) for one in alike)
        better = ", ".join(map(make_command_role, alike))
        raise MissingChannelError(
            f"mapped as pressures, these step like commands: {columns}; the one of {name} goes "
            f"from {before / BAR:.3g} to {after / BAR:.3g} bar between two samples at {time:.3f} s",
            f"map them as {better}, and record the pressures at the clutches. {_WITHOUT}",
            where,
        )
    roles = dict.fromkeys(map(make_command_role, elements))
    commands = [log[role] for role in roles if role in log]
    if commands and not named:
        listed = ", ".join(repr(one.source_name) for one in commands)
        stepwise = [one for one in commands if find_command_step(one) is not None]
        why = "these step like commands" if stepwise else "these are commands by their name"
        raise MissingChannelError(
            f"no clutch pressure is measured; {why}: {listed}",
            f"record the pressures at the clutches beside their commands. {_WITHOUT}",
            where,
        )
