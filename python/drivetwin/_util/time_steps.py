# SPDX-License-Identifier: MIT
"""Properties of stamps, computed once for the channels of a table that share them."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from functools import wraps
from typing import TypeVar

import numpy as np

from drivetwin._util.arrays import FloatArray

_LEAST = 10_000
"""Samples from which a result is worth to be kept."""

LONGEST_SPAN = 1e10
"""Longest time [s] that a record may span: 300 years, more than any clock of a logger shows."""

Result = TypeVar("Result")


def remember_for_stamps(function: Callable[[FloatArray], Result]) -> Callable[[FloatArray], Result]:
    """Keep the result of a function of long stamps as long as their array exists.

    Nobody may change the array.
    """
    known: dict[int, tuple[weakref.ref[FloatArray], Result]] = {}

    @wraps(function)
    def remembered(time: FloatArray) -> Result:
        if time.size < _LEAST:
            return function(time)
        key = id(time)
        found = known.get(key)
        if found is not None and found[0]() is time:
            return found[1]
        result = function(time)
        known[key] = (weakref.ref(time, lambda _: known.pop(key, None)), result)
        return result

    return remembered


@remember_for_stamps
def compute_median_step(time: FloatArray) -> float:
    """Return the median distance [s] of the stamps `time` (n,), n > 1."""
    return float(np.median(np.diff(time)))


@remember_for_stamps
def is_time_axis(time: FloatArray) -> bool:
    """Return whether the stamps `time` (n,) [s] span a time that a record can have.

    Others are refused by the checks of channels. What looks at a record before these checks asks
    here, because a span of zero or of 1e300 s makes its numbers meaningless.
    """
    if time.size < 2 or not np.isfinite(time).all():
        return False
    return 0.0 < float(time[-1]) - float(time[0]) < LONGEST_SPAN
