# SPDX-License-Identifier: MIT
"""Shift of time stamps with a distant epoch, such as 1970, to the first stamp of the log.

Far from zero a float has too few digits for the fractions of a sample that a simulation needs.
All channels of a log have the same origin, so their relative timing does not change.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from drivetwin.channels.shiftlog import FloatArray

FAR = 1e5
"""Start [s] beyond which time counts from the first stamp: a clock of the day (86,400 s) is below.

A log from there on may last ten days before it reaches `LATEST` of the simulation.
"""


def find_origin(starts: Iterable[float]) -> float:
    """Return the first of the stamps [s] that are beyond FAR; 0 without any.

    `starts` are the first stamps of all time bases of a log.
    """
    return min((float(start) for start in starts if FAR < abs(start) < math.inf), default=0.0)


def subtract_origin(time: FloatArray, origin: float) -> FloatArray:
    """Return `time` (n,) [s] from `origin` on.

    Decimals that a number as large as the origin cannot hold are rounded away, or even steps would
    come out uneven.
    """
    if origin == 0.0:
        return time
    with np.errstate(over="ignore"):  # a damaged stamp may become infinite: no stamp then
        return np.round(time - origin, -math.ceil(math.log10(np.spacing(abs(origin)))))


def describe_origin(origin: float) -> tuple[str, ...]:
    """Words for an origin that is not zero."""
    return (f"time counts from the first stamp, {origin:.15g} s",) if origin else ()
