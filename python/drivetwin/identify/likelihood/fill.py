# SPDX-License-Identifier: MIT
"""Pressure near the fill point, where its noise does not average out.

The capacity grows with max(0, P - P0). Where the pressure stays near P0, as it does while a TCU
holds the kiss point, noise of standard deviation σ adds up to 0.4·σ to it. There, and only
there, the pressure is replaced by a local mean whose window is as long as the noise allows:
windows grow until the interval of the mean leaves those of the shorter ones (intersection of
confidence intervals; Goldenshluger and Nemirovski 1997).
"""

from __future__ import annotations

import numpy as np

from drivetwin.identify.signals import FloatArray, PriorValue, Sampled

HALF_WIDTHS = (0, 1, 2, 4, 8, 16, 32, 64)
"""Windows tried: so many samples on either side."""
INTERVAL = 2.5
"""Half width of an interval in standard deviations of its mean."""
NEAR = 5.0
"""Distance from P0 in standard deviations of a sample within which noise would be cut off."""


def near_fill(pressure: Sampled, P0: PriorValue) -> FloatArray:
    """Pressure (n,) with local means in place of samples near `P0`; as read where it is exact."""
    if pressure.sigma == 0.0:
        return pressure.values
    mean = local_mean(pressure)
    reach = NEAR * pressure.sigma + 2.0 * P0.std
    share = np.clip(2.0 - np.abs(mean - P0.value) / reach, 0.0, 1.0)
    return np.asarray(share * mean + (1.0 - share) * pressure.values)


def local_mean(signal: Sampled) -> FloatArray:
    """Signal (n,) without its noise, as far as the noise level allows to tell it.

    At every sample the mean over the longest window that agrees with those over all shorter ones.
    """
    values = signal.values
    low, high = np.full(values.size, -np.inf), np.full(values.size, np.inf)
    mean, open_ = values.copy(), np.ones(values.size, dtype=bool)
    for half in HALF_WIDTHS:
        padded = np.pad(values, half, mode="edge")
        total = np.cumsum(np.concatenate([[0.0], padded]))
        trial = (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
        margin = INTERVAL * signal.sigma / np.sqrt(2 * half + 1)
        low, high = np.maximum(low, trial - margin), np.minimum(high, trial + margin)
        open_ &= low <= high
        mean = np.where(open_, trial, mean)
    return np.asarray(mean)
