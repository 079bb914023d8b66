# SPDX-License-Identifier: MIT
"""Minimum of a function of one variable; spares the import of a library of optimisers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

_GOLDEN = 0.5 * (3.0 - float(np.sqrt(5.0)))
_ROUND_OFF = float(np.sqrt(2.2e-16))
_MOST = 500
"""Largest number of evaluations."""


def minimize_bounded(
    function: Callable[[float], float], bounds: tuple[float, float], tolerance: float
) -> float:
    """Return a local minimum of `function` within `bounds`, to about `tolerance`.

    Steps go to the vertex of the parabola through the three best places, or by golden section.

    References
    ----------
    R. P. Brent, Algorithms for Minimization without Derivatives, 1973, chapter 5.
    G. E. Forsythe, M. A. Malcolm, C. B. Moler, Computer Methods for Mathematical Computations,
    1977, `fmin`.
    """
    low, high = bounds
    start = low + _GOLDEN * (high - low)
    # The best place, the second best and the one that was second best before.
    best = second = third = (start, function(start))
    step = previous = 0.0
    for _ in range(_MOST):
        here, middle = best[0], 0.5 * (low + high)
        least = _ROUND_OFF * abs(here) + tolerance / 3.0
        if abs(here - middle) <= 2.0 * least - 0.5 * (high - low):
            break
        vertex = None
        if abs(previous) > least:
            vertex = _find_vertex(best, second, third, previous)
        if vertex is not None and low < here + vertex < high:
            previous, step = step, vertex
            if min(here + step - low, high - here - step) < 2.0 * least:
                step = least if middle >= here else -least
        else:
            previous = (low if here >= middle else high) - here
            step = _GOLDEN * previous
        place = here + (max(step, least) if step >= 0.0 else min(step, -least))
        found = (place, function(place))
        if found[1] <= best[1]:
            low, high = (here, high) if place >= here else (low, here)
            best, second, third = found, best, second
            continue
        low, high = (place, high) if place < here else (low, place)
        if found[1] <= second[1] or second[0] == here:
            second, third = found, second
        elif found[1] <= third[1] or third[0] in (here, second[0]):
            third = found
    return best[0]


def _find_vertex(
    best: tuple[float, float],
    second: tuple[float, float],
    third: tuple[float, float],
    previous: float,
) -> float | None:
    """Step from `best` to the vertex of the parabola through three places (x, y).

    None if it exceeds half of the step before the last one, `previous`.
    """
    r = (best[0] - second[0]) * (best[1] - third[1])
    q = (best[0] - third[0]) * (best[1] - second[1])
    p = (best[0] - third[0]) * q - (best[0] - second[0]) * r
    q = 2.0 * (q - r)
    p, q = (-p, q) if q > 0.0 else (p, -q)
    return p / q if abs(p) < abs(0.5 * q * previous) else None
