# SPDX-License-Identifier: MIT
"""Readers as they behave on the worst files: each takes a path and options, as those of formats."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from drivetwin.channels.roles import Column, ReadOptions
from drivetwin.errors import DamagedChannelError, Where
from drivetwin.logs.raw import RawChannel

NAMES = ("sound", "damaged", "hangs", "greedy", "dies", "faulty")


class HostileRecording:
    """Columns that are read, refused, or never read, by their names."""

    warnings: tuple[str, ...] = ("one warning",)
    columns = tuple(Column(name, "bar", "a group") for name in NAMES)

    def load(self, index: int, window: tuple[float, float] | None = None) -> RawChannel:
        """Read a column, or fail as its name says."""
        name = NAMES[index]
        if name == "damaged":
            raise DamagedChannelError("no numbers", "map another", Where(channel=name, time=0.5))
        if name == "hangs":
            time.sleep(600.0)
        if name == "greedy":
            np.ones(2**33)
        if name == "dies":
            print("a last word", file=sys.stderr)
            os._exit(7)
        if name == "faulty":
            raise ZeroDivisionError
        self.warnings = ("one warning", "another")
        print("what a library prints")
        time_stamps = np.linspace(0.0, 1.0, 100_000)
        values = np.where(time_stamps < 0.5, np.nan, -time_stamps)
        channel = RawChannel(name, None, time_stamps, values, "a group", ("a note \udce4",))
        return channel.select_window(window)


@contextmanager
def open_hostile(_path: Path, _options: ReadOptions) -> Iterator[HostileRecording]:
    """Open any file."""
    yield HostileRecording()


@contextmanager
def open_never(path: Path, _options: ReadOptions) -> Iterator[HostileRecording]:
    """Compute without end."""
    while True:
        path.name.lower()
    yield HostileRecording()
