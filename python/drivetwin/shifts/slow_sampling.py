# SPDX-License-Identifier: MIT
"""Boundaries where the speeds come so slowly that no curve can be fitted to a few of them.

Encoders on a bus send means over a period that is not the same for both shafts, so while the shaft
swings the two contradict each other by some per cent of what a shift changes, though the gear is
held. A slip counts as begun once it exceeds that; how much earlier it may have begun is in sigma.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_SHARE = 0.05
"""Slip, as a part of what it changes by over the shift, that counts as begun."""
_LIMIT = 4.0
"""Standard deviations of the noise beyond which a slip is no longer at rest."""
_STEEP = 3.0
"""Factor above the onset threshold at which the rate of a slip is evaluated."""
_LASTING = 3
"""So many samples at rest in a row are a gear held."""
_CALM = 2.0
"""Standard deviations of the noise within which these are."""


@dataclass(frozen=True)
class Crossing:
    """Time at which a slip leaves or reaches zero: `time` ± `sigma` [s]."""

    time: float
    sigma: float


def locate_slip_start(time: FloatArray, slip: FloatArray, noise: float) -> Crossing | None:
    """Locate the start of a slip (n,) that ends away from rest; None without one.

    `slip` [rad/s] is that of the off-going element, 0 at rest, up to the lock-up of the other.
    """
    moved = np.abs(slip)
    limit = max(_SHARE * float(moved[-1]), _LIMIT * noise)
    last = _find_last_rest_sample(moved, limit, noise)
    if last is None:
        return None
    at = _interpolate_crossing(time, moved, limit, last)
    calm = np.flatnonzero(moved[: last + 1] < _LIMIT * noise)
    rest = int(calm[-1]) if len(calm) else 0
    # A slip that creeps is seen before it is large.
    at = min(at, float(time[min(rest + _LASTING, len(time) - 1)]))
    # The capacity falls steadily, so a slip grows at least with the square of the time.
    far = max(min(_STEEP * limit, 0.5 * float(moved[last:].max())), limit)
    steep = _interpolate_crossing(time, moved, far, last)
    hidden = (steep - at) / (np.sqrt(_STEEP) - 1.0)
    early = 0.5 * max(at - float(time[rest]), hidden)
    return Crossing(at, float(np.hypot(early, _compute_step_error(time, last))))


def _find_last_rest_sample(moved: FloatArray, limit: float, noise: float) -> int | None:
    """Return the last sample of the lasting rest; None without one, or if it ends the signal.

    A slip that turns after a flare passes through zero and does not rest there.
    """
    below = moved < limit
    calm = np.convolve(moved < min(_CALM * noise, limit), np.ones(_LASTING), "valid") >= _LASTING
    ends = np.flatnonzero(calm) + _LASTING - 1 if calm.any() else np.flatnonzero(np.cumprod(below))
    if not len(ends):
        return None
    # From there on it is at rest as long as it stays below.
    last = int(ends[-1]) + int(np.cumprod(below[ends[-1] :]).sum()) - 1
    return last if last + 1 < len(moved) else None


def _interpolate_crossing(time: FloatArray, moved: FloatArray, limit: float, last: int) -> float:
    """Interpolate the time [s] at which `moved` (n,) first exceeds `limit` after sample `last`."""
    above = last + int(np.argmax(moved[last:] >= limit))
    return float(np.interp(limit, moved[above - 1 : above + 1], time[above - 1 : above + 1]))


def locate_slip_end(time: FloatArray, slip: FloatArray, noise: float) -> Crossing | None:
    """Locate the end of a slip (n,) that starts away from rest; None if it never ends.

    `slip` [rad/s] is that of the on-coming element, 0 where it is locked.
    """
    limit = max(0.5 * _SHARE * float(np.abs(slip[0])), _LIMIT * noise)
    calm = (np.abs(slip) < limit).astype(np.int64)
    lasting = np.flatnonzero(np.convolve(calm, np.ones(_LASTING), "valid") >= _LASTING)
    moving = np.flatnonzero(calm[: lasting[0]] == 0) if len(lasting) else np.empty(0, np.intp)
    if not len(moving):
        return None
    last = int(moving[-1])
    step = float(time[last + 1] - time[last])
    hidden = _extrapolate_to_rest(time[: last + 1], np.abs(slip[: last + 1]), limit)
    if hidden > step:
        return Crossing(
            float(time[last]) + hidden,
            float(np.hypot(0.5 * hidden, _compute_step_error(time, last))),
        )
    pace = float(slip[last] - slip[last + 1])
    share = float(np.clip(slip[last] / pace, 0.0, 1.0)) if pace != 0.0 else 1.0
    # Half of what the limit of rest hides, at the pace of the last step.
    reach = min(0.5 * limit / abs(pace), 1.0) if pace != 0.0 else 1.0
    return Crossing(
        float(time[last]) + share * step,
        float(np.hypot(reach * step, _compute_step_error(time, last))),
    )


def _extrapolate_to_rest(time: FloatArray, moved: FloatArray, limit: float) -> float:
    """Time [s] that a slip takes from its last number to zero, at its pace down to the limit.

    Returns zero if the decrease has too few samples for a rate.
    """
    high = int(np.flatnonzero(moved >= min(_STEEP * limit, 0.5 * float(moved.max())))[-1])
    fall = float(moved[high] - moved[-1])
    if len(moved) - 1 - high < _LASTING or fall <= 0.0:
        return 0.0
    return float(time[-1] - time[high]) * float(moved[-1]) / fall


def _compute_step_error(time: FloatArray, index: int) -> float:
    """Standard deviation [s] of an instant known to lie between two samples."""
    return float(time[index + 1] - time[index]) / float(np.sqrt(12.0))
