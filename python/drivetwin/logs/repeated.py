# SPDX-License-Identifier: MIT
"""Values that several messages repeat, on a bus whose stamps jitter or that loses messages.

There is no raster then (held.py), but most changes still come as many messages apart. So they do
where a logger shows such a bus on even stamps of its own, each change near where it came.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drivetwin.logs.shiftlog import Channel, Quantity

_LEAST = 30
"""Changes from which on their distances tell a period."""
_EVEN = 0.02
"""Part of a step by which stamps may differ and still show a raster if there is one."""
_NEAR = 0.6
"""Steps within which a distance of changes is the usual one ..."""
_NEAR_PART = 0.25
"""... or, on even stamps, this part of it."""
_MOST = 0.5
"""Least share of changes at the usual distance."""
_CLOSE = 1.5
"""Steps below which two changes are nearer than a repeated value has them ..."""
_SELDOM = 0.25
"""... but for so many whose first message was lost."""
_CLOSE_PART = 0.5
"""The same as a part of the usual distance, on even stamps."""
_STAIRS = 1.5
"""Times the least of all changes above which one is no stair of a rounded signal ..."""
_LARGER = 0.2
"""... and the least share of such among changes at the usual distance: a signal that is not held
goes stair by stair where it does not change with each sample."""
_PAUSE = 1.5
"""Steps from an instant within which a message stands for it."""


def repeat_period(channel: Channel) -> float | None:
    """Period [s] of the updates of a channel whose values are repeated.

    None where each sample may be an update. On even stamps, where changes do jitter, those of a
    rounded signal may seem to be updates: there some must be larger than a step of the rounding.
    """
    changed = np.flatnonzero(np.diff(channel.values) != 0.0) + 1
    if channel.quantity is Quantity.STATE or changed.size < _LEAST:
        return None
    step = channel.step
    apart = np.maximum(np.diff(changed), np.diff(channel.time[changed]) / step)
    usual = round(float(np.median(apart)))
    near, close, least = _NEAR, _CLOSE, 0.0
    if np.abs(np.diff(channel.time) / step - 1.0).max() < _EVEN:
        near, close = max(near, _NEAR_PART * usual), max(close, _CLOSE_PART * usual)
        least = _LARGER
    at_usual = np.abs(apart - usual) < near
    often = np.mean(at_usual) > _MOST and np.mean(apart < close) < _SELDOM
    if usual <= 1 or not often:
        return None
    size = np.abs(np.diff(channel.values))[changed - 1]
    larger = np.mean(size[1:][at_usual] > _STAIRS * size.min())
    return usual * step if larger >= least else None


def updates_by_count(channel: Channel, period: float) -> NDArray[np.intp]:
    """Samples at which an update arrives: the changes, and between them one for each period."""
    changed = np.concatenate(([0], np.flatnonzero(np.diff(channel.values) != 0.0) + 1))
    last = channel.time.size - 1
    ends = channel.time[np.append(changed, last)]
    most = np.maximum(np.diff(np.append(changed, last)), 1)
    count = np.clip(np.round(np.diff(ends) / period), 1, most).astype(int)
    between = zip(pairwise(ends), count, strict=True)
    instants = np.concatenate([np.linspace(*p, n, endpoint=False)[1:] for p, n in between])
    nearest = np.searchsorted(channel.time, instants - 0.5 * channel.step)
    there = np.abs(channel.time[nearest] - instants) <= _PAUSE * channel.step
    return np.unique(np.concatenate((changed, nearest[there])))
