# SPDX-License-Identifier: MIT
"""How a log is read: its columns, options, and the conversion of columns to roles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field


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


@dataclass(frozen=True)
class ChannelSpec:
    """Conversion of a column to a role: sign·(scale·column + offset) in `unit`, then in SI.

    `unit` overrides the unit of the file (None: unit of the file). `time_shift` [s] is added to
    the time stamps. `group` chooses among columns of one name (None: the name is unique).
    """

    source: Annotated[str, Field(min_length=1)]
    unit: str | None = None
    sign: Literal[1, -1] = 1
    scale: Annotated[float, Field(gt=0)] = 1.0
    offset: float = 0.0
    time_shift: Annotated[float, Field(alias="time_shift_s")] = 0.0
    group: str | None = None

    def matches(self, column: Column) -> bool:
        """Return True if the spec refers to this column."""
        return column.name == self.source and self.group in (None, column.group)


@dataclass(frozen=True)
class RememberedChannel:
    """Spec by which an earlier log was read, and the unit that its file named (None: none)."""

    spec: ChannelSpec
    file_unit: str | None = None


@dataclass(frozen=True)
class RememberedMapping:
    """Channels by role and options by which an earlier log was read.

    Of the DBC files only the names count; they are looked for beside the log.
    """

    channels: Mapping[str, RememberedChannel] = field(default_factory=dict)
    options: ReadOptions = field(default_factory=ReadOptions)
