# SPDX-License-Identifier: MIT
"""Array types, and properties of time stamps that are kept as long as their arrays."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


Span = tuple[float, float]


LONGEST_SPAN = 1e10
"""Longest time [s] that a record may span: 300 years, more than any clock of a logger shows."""

SHORTEST_STEP = 2.5e-5
"""Shortest plausible median time [s] between stamps. Stamps of 50 Hz in s that are read as ms
(2e-5 s) are below."""

P = ParamSpec("P")
Result = TypeVar("Result")


def remember_for_arrays(function: Callable[P, Result]) -> Callable[P, Result]:
    """Keep the result of a function of arrays as long as these exist.

    Nobody may change the arrays, and the result must not refer to them. Arrays are passed by
    position.
    """
    known: dict[tuple[int, ...], tuple[tuple[weakref.ref[object], ...], Result]] = {}

    @wraps(function)
    def remembered(*arrays: P.args, **none: P.kwargs) -> Result:
        key = tuple(map(id, arrays))
        found = known.get(key)
        if found is not None:
            return found[1]
        result = function(*arrays, **none)
        references = tuple(weakref.ref(one, lambda _: known.pop(key, None)) for one in arrays)
        known[key] = references, result
        return result

    return remembered


def propagate_variance(slopes: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return the variances (n,) of values with `slopes` (n, p) by parameters of a `covariance`
    (p, p)."""
    return np.asarray(np.maximum(np.sum((slopes @ covariance) * slopes, axis=1), 0.0))


@remember_for_arrays
def compute_median_step(time: FloatArray) -> float:
    """Return the median distance [s] of the stamps `time` (n,), n > 1."""
    return float(np.median(np.diff(time), overwrite_input=True))


@remember_for_arrays
def is_time_axis(time: FloatArray) -> bool:
    """Return whether the stamps `time` (n,) [s] have order, span and step of a record.

    Others are refused by the checks of channels. Code that looks at a record before these checks
    asks here, because a span of 1e300 s or a step of 1e-300 s makes its numbers meaningless.
    """
    if time.size < 2 or not np.isfinite(time).all():
        return False
    if np.any(time[1:] < time[:-1]) or float(time[-1]) - float(time[0]) >= LONGEST_SPAN:
        return False
    return compute_median_step(time) >= SHORTEST_STEP
