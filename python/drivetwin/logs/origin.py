# SPDX-License-Identifier: MIT
"""Time stamps that count from far back, as from 1970, are made to count from the first of the log.

So far from zero a stamp has no digits left for the fractions of a sample that a simulation tells
apart. Channels of one log share one origin: how they lie to each other stays.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from drivetwin.channels.shiftlog import FloatArray
from drivetwin.simulation.dual_clutch import LATEST


def origin_of(starts: Iterable[float]) -> float:
    """Return the first of the stamps [s] that are beyond LATEST; 0 without any.

    `starts` are the first stamps of all time bases of a log.
    """
    return min((float(start) for start in starts if LATEST < abs(start) < math.inf), default=0.0)


def since(time: FloatArray, origin: float) -> FloatArray:
    """Return `time` (n,) [s] from `origin` on.

    Decimals that a number as large as the origin cannot hold are rounded away, or even steps would
    come out uneven.
    """
    if origin == 0.0:
        return time
    with np.errstate(over="ignore"):  # a damaged stamp may become infinite: no stamp then
        return np.round(time - origin, -math.ceil(math.log10(np.spacing(abs(origin)))))


def origin_told(origin: float) -> tuple[str, ...]:
    """Words for an origin that is not zero."""
    return (f"time counts from the first stamp, {origin:.15g} s",) if origin else ()
