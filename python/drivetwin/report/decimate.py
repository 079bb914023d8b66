# SPDX-License-Identifier: MIT
"""Long traces drawn as their envelope: no peak is lost, the file stays small."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from drivetwin.identify.result import FloatArray

MAX_POINTS = 4000
_OUTSIDE = 600
"""Points on either side of a focus: enough for a view of the whole log."""


def envelope(
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
    kept = [
        start + offset for start, end in pairwise(bins) for offset in _picked(values[start:end])
    ]
    return time[kept], values[kept]


def focused(
    time: FloatArray, values: FloatArray, focus: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """Envelope of a trace (n,) that keeps its points where they are looked at: inside `focus` [s].

    Traces of up to MAX_POINTS come back unchanged.
    """
    if time.size <= MAX_POINTS:
        return time, values
    first, last = np.searchsorted(time, focus)
    parts = [
        envelope(time[:first], values[:first], _OUTSIDE),
        envelope(time[first:last], values[first:last], MAX_POINTS - 2 * _OUTSIDE),
        envelope(time[last:], values[last:], _OUTSIDE),
    ]
    return np.concatenate([t for t, _ in parts]), np.concatenate([v for _, v in parts])


def _picked(values: FloatArray) -> list[int]:
    if np.isnan(values).all():
        return [0]
    chosen = {0, int(np.nanargmin(values)), int(np.nanargmax(values)), values.size - 1}
    return sorted(chosen)
