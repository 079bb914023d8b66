# SPDX-License-Identifier: MIT
"""Options of reading a log file."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Column:
    """A column of a file by name, unit as written (None: none) and group.

    The group distinguishes equal names: raster of a measurement file, message and sender on a
    bus; blank where the format has none. `empty`: it holds too few numbers for any role. `silent`:
    its sender never sends a value; it is no candidate for any role. `aside`: the responsible
    control unit sends it too; a candidate only if there is no other.
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
    """Time column and its unit as stated by the user (None: detected).

    `simultaneous`: all values of a row belong to its stamp, however coarse the rows.
    """

    source: str | None = None
    unit: str | None = None
    simultaneous: bool = False


@dataclass(frozen=True)
class BusOptions:
    """Options for decoding a bus log.

    `databases` are DBC files (none: the built-in J1939 messages); `reference_torque` [N·m] is the
    100 % value of percent torques and overrides the one on the bus.
    """

    databases: tuple[Path, ...] = ()
    reference_torque: float | None = None


@dataclass(frozen=True)
class ReadOptions:
    """Options for reading a file.

    Columns whose name is `ignored` get no role by their name; a mapping may still name them.
    """

    time: TimeColumn = field(default_factory=TimeColumn)
    bus: BusOptions = field(default_factory=BusOptions)
    ignored: tuple[str, ...] = ()
