# SPDX-License-Identifier: MIT
"""Slow signals that a logger repeats on a faster time base: which samples are fresh."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drivetwin.logs.shiftlog import Channel


def fresh_samples(channel: Channel) -> NDArray[np.intp]:
    """Indices of the samples that carry a new value, (m,).

    All samples unless the channel is `held`. The raster is the shortest time between changes; a
    value that an update repeats shows no change, so gaps are filled on that raster. A held channel
    that never changes keeps its first sample.
    """
    if not channel.held:
        return np.arange(channel.time.size)
    changes = np.flatnonzero(np.diff(channel.values)) + 1
    if changes.size < 2:
        return np.concatenate(([0], changes))
    raster = float(np.diff(channel.time[changes]).min())
    stamps = [channel.time[changes[0]]]
    for start, end in pairwise(changes):
        span = channel.time[end] - channel.time[start]
        steps = max(1, round(span / raster))
        stamps.extend(channel.time[start] + span * np.arange(1, steps + 1) / steps)
    ahead = np.arange(channel.time[changes[0]] - raster, channel.time[0] - raster / 2, -raster)
    behind = np.arange(channel.time[changes[-1]] + raster, channel.time[-1], raster)
    return _nearest(channel, np.concatenate((ahead[::-1], stamps, behind)))


def _nearest(channel: Channel, stamps: NDArray[np.float64]) -> NDArray[np.intp]:
    after = np.clip(np.searchsorted(channel.time, stamps), 1, channel.time.size - 1)
    closer_before = stamps - channel.time[after - 1] < channel.time[after] - stamps
    return np.unique(np.clip(after - closer_before, 0, channel.time.size - 1))
