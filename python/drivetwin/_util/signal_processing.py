# SPDX-License-Identifier: MIT
"""Filters and properties of sampled signals, independent of channels and logs."""

from __future__ import annotations

import numpy as np

from drivetwin._util.arrays import FloatArray


def compute_moving_mean(values: FloatArray, width: int) -> FloatArray:
    """Return the centred mean (n,) of `values` (n,) over `width` samples.

    Towards both ends the window shrinks on both sides alike, so that constants and ramps are kept
    up to the first and last sample. An even window reaches one sample further back.
    """
    if width <= 1 or values.size <= 2:
        return values.astype(np.float64)
    before, after = width // 2, (width - 1) // 2
    index = np.arange(values.size)
    reach = np.minimum(index, index[::-1])
    mean = np.empty(values.size)
    inner = (index >= before) & (index < values.size - after)
    if inner.any():
        mean[inner] = np.convolve(values, np.ones(width) / width, mode="valid")
    for sample in index[~inner]:
        mean[sample] = values[sample - reach[sample] : sample + reach[sample] + 1].mean()
    return mean
