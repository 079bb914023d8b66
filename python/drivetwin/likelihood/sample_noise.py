# SPDX-License-Identifier: MIT
"""Noise of samples, their rounding included, and the noise of the same power on a grid of steps.

Rounding errors are noise of a signal that its own noise does not dither. While the signal stays at
a level the error stays too: its mean over that time is as far off as one sample, and noise of the
same size that comes and goes from sample to sample would be far less. Each stay has an error of its
own, so its effect is that of white noise of the same power there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from drivetwin._util.arrays import FloatArray
from drivetwin.likelihood.input_smoothing import smooth_adaptive
from drivetwin.likelihood.measured_signal import MeasuredSignal, estimate_quantization_error


@dataclass(frozen=True, eq=False)
class Quantization:
    """Errors of the samples of a rounded signal that do not average out.

    `error` is the standard deviation of the mean error of one stay at a level, in the signal's
    unit; `stay` (m,) the number of the stay that each sample belongs to, from 0.
    """

    error: float
    stay: NDArray[np.intp]

    def select(self, kept: slice) -> Quantization:
        """Return the errors of the samples in a slice."""
        return Quantization(self.error, self.stay[kept])

    @property
    def sigma(self) -> FloatArray:
        """White noise (m,) of the samples with the same power: its mean over a stay is `error`."""
        return np.asarray(self.error * np.sqrt(np.bincount(self.stay)[self.stay]))


def estimate_quantization(signal: MeasuredSignal, step: float) -> Quantization | None:
    """Compute the errors that quantization to `step` leaves, in the signal's unit; None if noise
    dithers them."""
    error = estimate_quantization_error(signal, step)
    if error == 0.0:
        return None
    level = np.round(smooth_adaptive(signal) / step)
    return Quantization(error, np.cumsum(np.diff(level, prepend=level[0]) != 0.0))


def spread_over_steps(grid: FloatArray, stamps: FloatArray, variance: FloatArray) -> FloatArray:
    """Compute the variance (N-1,) of noise that is constant over each step of `grid` (N,) and has
    the power of white samples at `stamps` (m,) with a `variance` (m,)."""
    middle = 0.5 * (grid[1:] + grid[:-1])
    between = float(np.median(np.diff(stamps)))
    return np.asarray(np.interp(middle, stamps, variance) * between / np.diff(grid))


def average_at_samples(grid: FloatArray, steps: FloatArray, stamps: FloatArray) -> FloatArray:
    """Compute the noise of samples at `stamps` (m,) from that over each step of `grid` (N-1,).

    A sample acts on the steps about it as interpolation has it; its expected noise is their mean
    with the same weights, the transpose of interpolation.
    """
    middle, width = 0.5 * (grid[1:] + grid[:-1]), np.diff(grid)
    total = build_interpolation(stamps, middle, (0, stamps.size)).T @ (width * steps)
    return np.asarray(total / float(np.median(np.diff(stamps))))


def build_interpolation(stamps: FloatArray, at: FloatArray, columns: tuple[int, int]) -> csr_array:
    """Build the matrix (m, count) that interpolates linearly from `stamps` (n,) to `at` (m,).

    Held beyond both ends. `columns` are the first of the stamps' columns and the count of all.
    """
    first, count = columns
    after = np.clip(np.searchsorted(stamps, at), 1, stamps.size - 1)
    share = (at - stamps[after - 1]) / (stamps[after] - stamps[after - 1])
    share = np.clip(share, 0.0, 1.0)
    data = np.column_stack([1.0 - share, share]).ravel()
    index = first + np.column_stack([after - 1, after]).ravel()
    return csr_array((data, index, 2 * np.arange(at.size + 1)), shape=(at.size, count))
