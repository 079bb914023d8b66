# SPDX-License-Identifier: MIT
"""A log in memory: named channels, each on its own time base, SI inside."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import compute_median_step, remember_for_arrays
from drivetwin._util.display_units import DisplayMixin
from drivetwin.channels.filling import Filling
from drivetwin.channels.roles import (
    Quantity,
    RememberedMapping,
    get_pressure_element,
    make_pressure_role,
)
from drivetwin.channels.update_raster import UpdateRaster, find_raster, find_updates
from drivetwin.errors import MissingChannelError, TimeError, Where
from drivetwin.findings import Finding
from drivetwin.simulation.dual_clutch import LATEST

FloatArray = NDArray[np.float64]

GAP_STEPS, GAP_QUANTILE = 5.0, 0.75
"""A pause of more than so many usual steps is a gap: nothing is interpolated across it. The usual
step is this quantile: the median may be the short one of two that alternate, as with a row for each
message."""


@remember_for_arrays
def compute_gap_limit(time: FloatArray) -> float:
    """Return the longest pause [s] between samples at `time` (n,) that is not a gap."""
    if time.size < 2:
        return np.inf
    return GAP_STEPS * float(np.quantile(np.diff(time), GAP_QUANTILE))


def find_uncovered_ends(
    time: FloatArray, span: tuple[float, float]
) -> tuple[tuple[float, float], ...]:
    """Return the parts of `span` [s] outside the samples that are longer than a gap."""
    limit = compute_gap_limit(time)
    first, last = float(time[0]), float(time[-1])
    ends = ((span[0], min(first, span[1])), (max(last, span[0]), span[1]))
    return tuple((low, high) for low, high in ends if high - low > limit)


@remember_for_arrays
def find_pauses(time: FloatArray) -> tuple[tuple[float, float], ...]:
    """Gaps between samples at `time` (n,): from the last sample before to the first one after."""
    wide = np.flatnonzero(np.diff(time) > compute_gap_limit(time))
    return tuple((float(time[i]), float(time[i + 1])) for i in wide)


@dataclass(frozen=True, eq=False)
class Channel:
    """One measured signal.

    `role` is what it is to the driveline: `engine_torque`, `output_torque`, `input_speed`,
    `engine_speed`, `output_speed`, `wheel_speed`, `pressure.<element>`, `throttle`, `gear`, ...
    `time` (n,) in s strictly increasing; `values` (n,) in SI. `source_name` and `source_unit`
    are as in the file. `held` marks a slow signal that the logger repeated on a faster time base.
    `late` [s] is how much older than its stamp a value may be, as a row of a coarse table.
    `filling` is how another tool had filled the channel up; where its knots are known they are the
    samples of this channel, else the recorded samples are.
    """

    role: str
    quantity: Quantity
    time: FloatArray
    values: FloatArray
    source_name: str
    source_unit: str
    held: bool = False
    late: float = 0.0
    filling: Filling | None = None

    @cached_property
    def step(self) -> float:
        """Median sample interval [s]."""
        return compute_median_step(self.time)

    @cached_property
    def gap_limit(self) -> float:
        """Longest pause [s] between samples that is not a gap."""
        return compute_gap_limit(self.time)

    @property
    def place(self) -> Where:
        """Place of a finding on the whole channel."""
        return Where(channel=self.source_name)

    @cached_property
    def raster(self) -> UpdateRaster | None:
        """Update raster of the channel; None if each sample may be an update."""
        if self.quantity is Quantity.STATE:
            return None
        return find_raster(self.time, self.values)

    @cached_property
    def fresh(self) -> Channel:
        """The updates of a channel of which it is not known yet whether it is `held`."""
        return replace(self, held=self.raster is not None).updates

    @cached_property
    def updates(self) -> Channel:
        """The channel reduced to the instants at which its value was updated.

        The value at such an instant is the newest that the sender had, `te_delay` old. A channel
        that is not `held` is returned as it is.
        """
        if not self.held or self.quantity is Quantity.STATE:
            return self
        found = find_updates(self.time, self.values)
        if found is None:
            return self
        time, samples = found
        return replace(self, time=time, values=self.values[samples], held=False)

    def interpolate(self, time: FloatArray) -> FloatArray:
        """Values at `time` (m,): linear between samples, held for states.

        NaN outside the span, and for all but states inside a gap (more than GAP_STEPS usual steps
        without a sample); a state that is sent on change only is known between its messages.
        """
        if time is self.time:  # as of channels of one table
            return self.values
        if self.quantity is Quantity.STATE:
            values = self.values[self._find_before(time)]
        else:
            values = np.interp(time, self.time, self.values)
        return np.where(self.covers(time), values, np.nan)

    def covers(self, time: FloatArray) -> NDArray[np.bool_]:
        """Return True for each `time` (m,) inside the span and outside the gaps."""
        known = (time >= self.time[0]) & (time <= self.time[-1])
        if self.gaps:
            before = self._find_before(time)
            after = np.clip(before + 1, None, self.time.size - 1)
            pause = self.time[after] - self.time[before]
            known &= (pause <= self.gap_limit) | (time <= self.time[before])
        return np.asarray(known)

    def _find_before(self, time: FloatArray) -> NDArray[np.intp]:
        """Return the last sample not after each `time` (m,)."""
        return np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, None)

    @property
    def gaps(self) -> tuple[tuple[float, float], ...]:
        """Spans [s] without samples, from the sample before to the sample after."""
        return () if self.quantity is Quantity.STATE else find_pauses(self.time)


def _suggest_channel(role: str) -> str:
    """Return the remedy for a missing role; a command is not suggested as a pressure."""
    if get_pressure_element(role) is None:
        return "name it in a channel mapping file (--channels) or in [channels] of the card"
    return (
        "record the pressure at the clutch and name its column in a channel mapping file "
        "(--channels); a commanded pressure is no measured one"
    )


@dataclass(frozen=True, eq=False, repr=False)
class ShiftLog(DisplayMixin):
    """All mapped channels of one recording, by role.

    `source` is its file and `sha256` that of the content, `mappings` the SHA-256 by name of the
    mapping file that it was read with, `mapping` the specs and options that were used. `absent` are
    the columns by role of a twin's log that this log does not have.
    Raises TimeError where the time of a channel reaches beyond LATEST, as stamps from 1970 do.
    """

    channels: Mapping[str, Channel]
    source: str
    sha256: str
    findings: tuple[Finding, ...] = ()
    mappings: Mapping[str, str] = field(default_factory=dict)
    mapping: RememberedMapping = field(default_factory=RememberedMapping)
    absent: Mapping[str, str] = field(default_factory=dict)

    @property
    def inputs(self) -> dict[str, str]:
        """SHA-256 by name of all files that the channels come from."""
        return {Path(self.source).name: self.sha256, **self.mappings}

    def __post_init__(self) -> None:
        for channel in self.channels.values():
            ends = channel.time[[0, -1]] if channel.time.size else channel.time
            if (np.abs(ends) > LATEST).any():
                raise TimeError(
                    f"time stamps from {ends[0]:.6g} s to {ends[1]:.6g} s, too far from zero",
                    f"let time count from the start of the log, or lie within {LATEST:g} s",
                    Where(file=self.source, channel=channel.source_name),
                )

    def __repr__(self) -> str:
        return f"<ShiftLog {self.source!r}: {', '.join(self.channels)}>"

    def __contains__(self, role: object) -> bool:
        return role in self.channels

    def __getitem__(self, role: str) -> Channel:
        try:
            return self.channels[role]
        except KeyError:
            had = self.absent.get(role)
            raise MissingChannelError(
                f"no channel for {role!r}; the log maps {', '.join(sorted(self.channels))}"
                + ("" if had is None else f"; the twin was identified with {had!r} for {role!r}"),
                _suggest_channel(role),
                Where(file=self.source),
            ) from None

    def get_pressure(self, element: str) -> Channel:
        """Pressure of a clutch or brake by its name on the card."""
        return self[make_pressure_role(element)]
