# SPDX-License-Identifier: MIT
"""Options of reading a log file."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Column:
    """A column of a file by name, unit as written (None: none) and group.

    The group is what tells equal names apart: raster of a measurement file, message and sender on a
    bus; blank where the format has none. `empty`: it holds too few numbers for any role. `silent`:
    its sender says throughout that there is no value; it is no candidate for any role. `aside`:
    the unit that it belongs to tells it too; a candidate only where no other is.
    """

    name: str
    unit: str | None = None
    group: str = ""
    empty: bool = False
    silent: bool = False
    aside: bool = False

    def __str__(self) -> str:
        return f"{self.name} ({self.group})" if self.group else self.name


@dataclass(frozen=True)
class TimeColumn:
    """Which column holds time and in what unit, where the user states it (None: as found).

    `simultaneous` says that all values of a row are of its stamp, however coarse the rows.
    """

    source: str | None = None
    unit: str | None = None
    simultaneous: bool = False


@dataclass(frozen=True)
class BusOptions:
    """How a bus log is decoded, where the user states it.

    `databases` are DBC files (none: the built-in J1939 messages); `reference_torque` [N·m] is what
    percent torque refers to, against the one that the bus tells.
    """

    databases: tuple[Path, ...] = ()
    reference_torque: float | None = None


@dataclass(frozen=True)
class ReadOptions:
    """What the user states about the file as a whole."""

    time: TimeColumn = field(default_factory=TimeColumn)
    bus: BusOptions = field(default_factory=BusOptions)
