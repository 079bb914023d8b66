# SPDX-License-Identifier: MIT
"""Slow signals that a logger repeats on a faster time base, as CAN torque in a 1 kHz table.

Only the instants of update carry information: a value is fresh there and stale until the next.
Rounding can make an update repeat the old value, so the updates are not the changes; they lie on a
regular raster of which the changes show a part.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivetwin.logs.shiftlog import Channel, FloatArray, Quantity

MIN_CHANGES = 10
"""Fewer changes of value cannot prove a raster."""

MAX_PERIOD = 0.25
"""Longest update period looked for [s]; CAN messages of interest come every 5 to 100 ms."""

_JITTER = 0.2
"""How far a change may lie from the raster, as part of the period ..."""

_JITTER_SAMPLES = 1.5
"""... and in samples of the logger."""

_PAUSE = 1.5
"""After more than so many steps without a sample nobody knows when the value arrived."""


@dataclass(frozen=True)
class Raster:
    """Instants of update `start` + k·`period` [s]."""

    start: float
    period: float


def find_raster(channel: Channel) -> Raster | None:
    """Return the update raster of a held channel; None where each sample may be an update.

    The period is the longest one, up to the shortest distance of two changes, on which all changes
    lie; start and period are fitted by least squares so that clock drift does not add up.
    """
    if channel.quantity is Quantity.STATE:
        return None
    changes = channel.time[1:][_changed(channel)]
    if changes.size < MIN_CHANGES:
        return None
    longest = min(float(np.diff(changes).min()) * (1.0 + _JITTER), MAX_PERIOD)
    for samples in range(round(longest / channel.step), 1, -1):
        raster = _fit(changes, samples * channel.step, channel.step)
        if raster is not None:
            return raster
    return None


def _changed(channel: Channel) -> NDArray[np.bool_]:
    """Whether each sample but the first brings a new value (n-1,); after a pause none can tell."""
    pause = np.diff(channel.time) > _PAUSE * channel.step
    return np.asarray((np.diff(channel.values) != 0.0) & ~pause)


def _fit(changes: FloatArray, period: float, step: float) -> Raster | None:
    """Least-squares raster near `period` through the changes; None if they do not lie on one."""
    steps = np.round(np.diff(changes) / period)
    if steps.min() < 1.0:
        return None
    count = np.concatenate(([0.0], np.cumsum(steps)))
    slope, start = np.polyfit(count, changes, 1)
    residual = np.abs(changes - start - slope * count).max()
    on_raster = residual <= min(_JITTER * slope, _JITTER_SAMPLES * step)
    return Raster(float(start), float(slope)) if on_raster and slope > 1.5 * step else None


def _update_indices(channel: Channel, raster: Raster) -> NDArray[np.intp]:
    """Samples at which an update arrives: the change near each raster instant, else the instant.

    An instant at which the channel has no sample brings none.
    """
    margin = 0.5 * channel.step
    first = np.ceil((channel.time[0] - margin - raster.start) / raster.period)
    last = np.floor((channel.time[-1] + margin - raster.start) / raster.period)
    instants = raster.start + raster.period * np.arange(first, last + 1.0)
    nearest = np.minimum(np.searchsorted(channel.time, instants - margin), channel.time.size - 1)
    there = np.abs(channel.time[nearest] - instants) <= _PAUSE * channel.step
    changed = np.flatnonzero(_changed(channel)) + 1
    slot = np.round((channel.time[changed] - instants[0]) / raster.period).astype(np.intp)
    inside = (slot >= 0) & (slot < instants.size)
    nearest[slot[inside]] = changed[inside]
    there[slot[inside]] = True
    return np.unique(nearest[there])


def fresh_samples(channel: Channel) -> Channel:
    """Return the channel reduced to the instants at which its value was updated.

    A channel that is not `held` is returned as it is. The value at such an instant is the newest
    the sender had, `te_delay` old; nothing is interpolated.
    """
    raster = find_raster(channel) if channel.held else None
    if raster is None:
        return channel
    fresh = _update_indices(channel, raster)
    return replace(channel, time=channel.time[fresh], values=channel.values[fresh], held=False)
