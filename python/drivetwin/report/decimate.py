# SPDX-License-Identifier: MIT
"""Long traces drawn as their envelope: no peak is lost, the file stays small."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray

MAX_POINTS = 4000
_OUTSIDE = 600
"""Points on either side of a focus: enough for a view of the whole log."""


def extract_envelope(
    time: FloatArray, values: FloatArray, max_points: int = MAX_POINTS
) -> tuple[FloatArray, FloatArray]:
    """First, smallest, largest and last sample of equal bins, in time order.

    Traces (n,) of up to `max_points` come back unchanged. Every extreme of the trace is kept and
    the result is a subset of its samples. NaN samples are taken as gaps and left out of a bin
    unless the bin holds nothing else.
    """
    if time.size <= max_points:
        return time, values
    bins = np.linspace(0, time.size, max_points // 4 + 1).astype(np.intp)
    kept = _select_extremes(values, bins[:-1], bins[1:])
    return time[kept], values[kept]


def decimate_around(
    time: FloatArray, values: FloatArray, focus: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """Decimate a trace (n,) to its envelope outside `focus` [s]; keep all points inside.

    Traces of up to MAX_POINTS come back unchanged.
    """
    if time.size <= MAX_POINTS:
        return time, values
    first, last = np.searchsorted(time, focus)
    parts = [
        extract_envelope(time[:first], values[:first], _OUTSIDE),
        extract_envelope(time[first:last], values[first:last], MAX_POINTS - 2 * _OUTSIDE),
        extract_envelope(time[last:], values[last:], _OUTSIDE),
    ]
    return np.concatenate([t for t, _ in parts]), np.concatenate([v for _, v in parts])


def _select_extremes(
    values: FloatArray, starts: NDArray[np.intp], ends: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Indices of what is kept of each bin; a bin without a number keeps its first sample."""
    inside = starts[:, None] + np.arange(int(np.max(ends - starts)))
    binned = values[np.minimum(inside, values.size - 1)]
    known = (inside < ends[:, None]) & ~np.isnan(binned)
    lowest = np.argmin(np.where(known, binned, np.inf), axis=1)
    highest = np.argmax(np.where(known, binned, -np.inf), axis=1)
    last = np.where(known.any(axis=1), ends - 1, starts)
    return np.unique(np.concatenate((starts, starts + lowest, starts + highest, last)))
