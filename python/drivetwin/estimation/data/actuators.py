# SPDX-License-Identifier: MIT
"""Commanded and measured pressures of the elements in logs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.actuator.model import ActuatorModel, HeldSignal
from drivetwin.channels.roles import Quantity, make_command_role, make_pressure_role
from drivetwin.channels.shiftlog import Channel, ShiftLog

_STEP = 1e-3
"""Step [s] of the raster of calculated pressures, linear between samples."""
_BEFORE, _AFTER = 0.05, 0.6
"""Time [s] about a change of the command within which samples are used."""
_SAMPLES = 2000
"""Largest number of samples of a log; more are thinned evenly."""


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


@dataclass(frozen=True, eq=False)
class PressureRecord:
    """Command [Pa] of one clutch, and its pressure (n,) [Pa] measured at `time` (n,) [s].

    `initial` [Pa] is the pressure before the first change of the command.
    """

    command: HeldSignal
    time: FloatArray
    pressure: FloatArray
    initial: float | None = None

    def select_changes(self) -> PressureRecord:
        """Select the samples near changes of the command, thinned evenly."""
        changes = self.command.drop_repeated()
        at = np.concatenate([[-np.inf], changes.time[1:], [np.inf]])
        following = np.searchsorted(at, self.time)
        near = self.time - at[following - 1] <= _AFTER
        near |= at[following] - self.time <= _BEFORE
        known = np.isfinite(self.pressure)
        index = np.flatnonzero(near & known)
        index = index[:: max(1, -(-index.size // _SAMPLES))]
        calm = self.pressure[(self.time < at[1]) & known]
        initial = float(calm.mean()) if calm.size else None
        return PressureRecord(changes, self.time[index], self.pressure[index], initial)


def collect_pressures(
    logs: Sequence[ShiftLog], elements: Iterable[str]
) -> dict[str, list[PressureRecord]]:
    """Collect the records of the elements whose command and pressure the logs contain."""
    found: dict[str, list[PressureRecord]] = {}
    for log, element in product(logs, elements):
        roles = make_command_role(element), make_pressure_role(element)
        if all(role in log for role in roles):
            command, pressure = (log[role] for role in roles)
            if np.isfinite(command.values).any():
                record = PressureRecord(get_held_command(command), pressure.time, pressure.values)
                found.setdefault(element, []).append(record)
    return found
