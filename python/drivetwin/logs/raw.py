# SPDX-License-Identifier: MIT
"""Interface of all readers: named columns in the units of the file, each on its own time base.

A reader opens a file as a `Recording`: it lists columns at once and loads one when asked, so that
memory is bounded by what is selected. Text files are in memory anyway: `RawLog`.

Time stamps with a distant epoch, such as 1970, count from the first stamp of the log: far from zero
a float has too few digits for the fractions of a sample that a simulation needs. All channels of a
log have the same origin, so their relative timing does not change.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np

from drivetwin._util.arrays import compute_median_step
from drivetwin.channels.filling import Filling, find_filling
from drivetwin.channels.roles import Column, ReadOptions
from drivetwin.channels.shiftlog import FloatArray, compute_gap_limit, find_pauses
from drivetwin.channels.update_raster import UpdateRaster, find_raster
from drivetwin.errors import DamagedChannelError, Where

HEAD_BYTES = 8192
"""Number of bytes of a file by which its format is recognised."""

MIN_SAMPLES = 10
"""Fewer samples of a channel cannot show a shift."""

Window = tuple[float, float]
"""First and last time [s] wanted of a recording."""


@dataclass(frozen=True, eq=False)
class RawChannel:
    """One column as recorded: `time` (n,) [s], `values` (n,) in `unit`; None: file names no unit.

    Values are NaN where the file contains NaN; a sample that the file does not have is absent.
    `notes` list the samples that the reader dropped, with the reason.
    """

    name: str
    unit: str | None
    time: FloatArray
    values: FloatArray
    group: str = ""
    notes: tuple[str, ...] = ()

    @property
    def stamps(self) -> FloatArray:
        """The time stamps that are numbers [s]."""
        known = np.isfinite(self.time)
        return self.time if known.all() else self.time[known]

    @property
    def step(self) -> float | None:
        """Median sample interval [s]; None below two samples."""
        stamps = self.stamps
        return compute_median_step(stamps) if stamps.size > 1 else None

    @property
    def rate(self) -> float | None:
        """Samples per second; None below two samples."""
        step = self.step
        return 1.0 / step if step is not None and step > 0.0 else None

    @property
    def raster(self) -> UpdateRaster | None:
        """Update raster of the column; None if each sample may be an update."""
        return find_raster(self.time, self.values)

    @property
    def filling(self) -> Filling | None:
        """Measured samples of a column that was filled up; None if each sample may be measured."""
        return find_filling(self.time, self.values)

    @property
    def range(self) -> tuple[float, float] | None:
        """Least and greatest number in the file's unit; None if there is no number."""
        if not self.values.size:
            return None
        least, greatest = float(self.values.min()), float(self.values.max())
        if math.isfinite(least) and math.isfinite(greatest):
            return least, greatest
        finite = self.values[np.isfinite(self.values)]
        return (float(finite.min()), float(finite.max())) if finite.size else None

    @property
    def gaps(self) -> tuple[Window, ...]:
        """Spans of time [s] without a number, from the sample before to the sample after."""
        stamps = self.time[np.isfinite(self.values) & np.isfinite(self.time)]
        wide = np.flatnonzero(np.diff(stamps) > compute_gap_limit(self.stamps))
        return tuple((float(stamps[index]), float(stamps[index + 1])) for index in wide)

    @property
    def pauses(self) -> int:
        """Number of interruptions of the stamps, with or without numbers next to them."""
        return len(find_pauses(self.stamps))

    def select_window(self, window: Window | None) -> RawChannel:
        """Return the samples in a window of time, both ends included; all without a window."""
        if window is None:
            return self
        inside = (self.time >= window[0]) & (self.time <= window[1])
        return RawChannel(
            self.name, self.unit, self.time[inside], self.values[inside], self.group, self.notes
        )


class Recording(Protocol):
    """An open file. `columns` are all it has, readable or not; `warnings` concern the whole."""

    @property
    def columns(self) -> Sequence[Column]: ...

    @property
    def warnings(self) -> tuple[str, ...]: ...

    def load(self, index: int, window: Window | None = None) -> RawChannel:
        """Read the column at `index` of `columns`.

        Raises DamagedChannelError where it holds no numbers.
        """
        ...


Opener = Callable[[Path, ReadOptions], AbstractContextManager[Recording]]
"""Function that opens a file of one format."""


@dataclass(frozen=True)
class Joined:
    """Several recordings as one: columns of the first one first."""

    parts: tuple[Recording, ...]

    @property
    def columns(self) -> tuple[Column, ...]:
        return tuple(column for part in self.parts for column in part.columns)

    @property
    def warnings(self) -> tuple[str, ...]:
        return tuple(text for part in self.parts for text in part.warnings)

    def load(self, index: int, window: Window | None = None) -> RawChannel:
        """Read the column at `index` from the part that has it; see `Recording`."""
        for part in self.parts:
            if index < len(part.columns):
                return part.load(index, window)
            index -= len(part.columns)
        raise IndexError(index)


MOST_REMEMBERED = 4 * 10**7
"""Samples that `Remembered` keeps at most."""


class Remembered:
    """A recording whose first channels are kept, as for a survey before they are used."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._kept: dict[int, RawChannel] = {}
        self._room = MOST_REMEMBERED

    @property
    def columns(self) -> Sequence[Column]:
        return self._recording.columns

    @property
    def warnings(self) -> tuple[str, ...]:
        return self._recording.warnings

    def load(self, index: int, window: Window | None = None) -> RawChannel:
        """Read the column at `index`, unless it is kept; see `Recording`."""
        if index in self._kept:
            return self._kept[index].select_window(window)
        channel = self._recording.load(index, window)
        if window is None and channel.values.size <= self._room:
            self._room -= channel.values.size
            self._kept[index] = channel
        return channel


@dataclass(frozen=True, eq=False)
class RawLog:
    """All columns of one file in memory. `unreadable`: reason for each column without numbers."""

    channels: tuple[RawChannel, ...]
    unreadable: Mapping[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    source: str = ""

    @property
    def columns(self) -> tuple[Column, ...]:
        """Readable columns first, in file order."""
        readable = (Column(one.name, one.unit, one.group) for one in self.channels)
        return (*readable, *(Column(name, empty=True) for name in self.unreadable))

    def load(self, index: int, window: Window | None = None) -> RawChannel:
        """Return the column at `index` of `columns`; raises DamagedChannelError without numbers."""
        if index < len(self.channels):
            return self.channels[index].select_window(window)
        name = self.columns[index].name
        raise DamagedChannelError(
            self.unreadable[name],
            "repair or empty the cell, or map another column",
            Where(file=self.source, channel=name),
        )

    def get_channels(self, name: str) -> tuple[RawChannel, ...]:
        """Return the channels of this exact name: none, one, or several if the file repeats it."""
        return tuple(channel for channel in self.channels if channel.name == name)


FAR = 1e5
"""Start [s] beyond which time counts from the first stamp: a clock of the day (86,400 s) is below.

A log from there on may last ten days before it reaches `LATEST` of the simulation.
"""


def find_origin(starts: Iterable[float]) -> float:
    """Return the first of the stamps [s] that are beyond FAR; 0 without any.

    `starts` are the first stamps of all time bases of a log.
    """
    return min((float(start) for start in starts if FAR < abs(start) < math.inf), default=0.0)


def subtract_origin(time: FloatArray, origin: float) -> FloatArray:
    """Return `time` (n,) [s] from `origin` on.

    Decimals that a number as large as the origin cannot hold are rounded away, or even steps would
    come out uneven.
    """
    if origin == 0.0:
        return time
    with np.errstate(over="ignore"):  # a damaged stamp may become infinite: no stamp then
        return np.round(time - origin, -math.ceil(math.log10(np.spacing(abs(origin)))))


def describe_origin(origin: float) -> tuple[str, ...]:
    """Words for an origin that is not zero."""
    return (f"time counts from the first stamp, {origin:.15g} s",) if origin else ()
