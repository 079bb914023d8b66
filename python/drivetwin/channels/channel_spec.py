# SPDX-License-Identifier: MIT
"""Conversion of a column to a role, and the mapping that a twin remembers from its log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivetwin.channels.read_options import Column, ReadOptions


@dataclass(frozen=True)
class ChannelSpec:
    """Conversion of a column to a role: sign·(scale·column + offset) in `unit`, then in SI.

    `unit` overrides the unit of the file (None: unit of the file). `time_shift` [s] is added to
    the time stamps. `group` chooses among columns of one name (None: the name is unique).
    """

    source: str
    unit: str | None = None
    sign: int = 1
    scale: float = 1.0
    offset: float = 0.0
    time_shift: float = 0.0
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
