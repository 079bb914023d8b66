# SPDX-License-Identifier: MIT
"""Median sample interval, computed once for the channels of a table that share their stamps."""

from __future__ import annotations

import weakref

import numpy as np

from drivetwin._util.arrays import FloatArray

_KNOWN: dict[int, tuple[weakref.ref[FloatArray], float]] = {}
"""Array and median by the identity of the array."""

_LEAST = 10_000
"""Samples from which a median is worth to be kept."""


def compute_median_step(time: FloatArray) -> float:
    """Return the median distance [s] of the stamps `time` (n,), n > 1.

    The median of a long array is kept as long as the array exists, which nobody may change.
    """
    if time.size < _LEAST:
        return float(np.median(np.diff(time)))
    key = id(time)
    known = _KNOWN.get(key)
    if known is not None and known[0]() is time:
        return known[1]
    median = float(np.median(np.diff(time)))
    _KNOWN[key] = (weakref.ref(time, lambda _: _KNOWN.pop(key, None)), median)
    return median
