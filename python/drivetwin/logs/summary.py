# SPDX-License-Identifier: MIT
"""Summary of each column of a file, with one column in memory at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin.channels.read_options import Column
from drivetwin.channels.shiftlog import Channel, FloatArray, Quantity
from drivetwin.errors import DamagedChannelError
from drivetwin.logs.quality.update_raster import find_raster
from drivetwin.logs.raw import RawChannel, Recording, Window


@dataclass(frozen=True)
class ColumnSummary:
    """A column as recorded: `rate` [Hz] of its updates, `range` in the file's unit.

    `span` is first and last time [s]; `gaps` counts samples without a number and interruptions.
    `fault` is the reason why a column has no numbers.
    """

    column: Column
    samples: int = 0
    rate: float | None = None
    range: tuple[float, float] | None = None
    span: Window | None = None
    gaps: int = 0
    fault: str | None = None


@dataclass(frozen=True)
class Summary:
    """All columns of a file in file order, and the warnings of its reader."""

    columns: tuple[ColumnSummary, ...]
    warnings: tuple[str, ...]


def summarise_recording(recording: Recording) -> Summary:
    """Look at every column of an open file; raises the errors of its reader."""
    found: list[ColumnSummary] = []
    for index, column in enumerate(recording.columns):
        try:
            found.append(_summarise_column(column, recording.load(index)))
        except DamagedChannelError as fault:
            found.append(ColumnSummary(column, fault=fault.what))
    return Summary(tuple(found), recording.warnings)


def _summarise_column(column: Column, channel: RawChannel) -> ColumnSummary:
    without = int(np.count_nonzero(~np.isfinite(channel.values)))
    return ColumnSummary(
        column=column,
        samples=channel.time.size,
        rate=_estimate_update_rate(channel),
        range=channel.range,
        span=(float(channel.time[0]), float(channel.time[-1])) if channel.time.size else None,
        gaps=without + channel.pauses,
    )


def _estimate_update_rate(channel: RawChannel) -> float | None:
    """Return the updates per second; for a held signal the rate of the sender."""
    step = channel.step
    if step is None or step <= 0.0:
        return None
    sent = Channel("", Quantity.FRACTION, channel.time, channel.values, channel.name, "")
    raster = find_raster(sent) if _is_in_order(channel.time) else None
    return 1.0 / (step if raster is None else raster.period)


def _is_in_order(time: FloatArray) -> bool:
    return bool(np.isfinite(time).all() and np.all(np.diff(time) > 0.0))
