# SPDX-License-Identifier: MIT
"""What every reader delivers: named columns in the file's own units, each on its own time base."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivetwin.logs.shiftlog import FloatArray


@dataclass(frozen=True)
class RawChannel:
    """One column as recorded: `time` (n,) [s], `values` (n,) in `unit`; None: file names no unit.

    Values may hold NaN where the file says so; a sample that the file does not have is absent.
    """

    name: str
    unit: str | None
    time: FloatArray
    values: FloatArray


@dataclass(frozen=True)
class RawLog:
    """All columns of one file. `unreadable` tells by name why a column holds no numbers."""

    channels: tuple[RawChannel, ...]
    unreadable: Mapping[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    def named(self, name: str) -> tuple[RawChannel, ...]:
        """Return the channels of this exact name: none, one, or several if the file repeats it."""
        return tuple(channel for channel in self.channels if channel.name == name)


@dataclass(frozen=True)
class TimeColumn:
    """Which column holds time and in what unit, where the user states it (None: as found)."""

    source: str | None = None
    unit: str | None = None
