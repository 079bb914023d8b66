# SPDX-License-Identifier: MIT
"""Zero-phase low-pass; spares the import of a library of filters."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_banded

from drivetwin._util.arrays import FloatArray

_PADDING = 9
"""Samples of the odd extension at both ends: three times the number of coefficients."""


def filter_zero_phase(values: FloatArray, step: float, cutoff: float) -> FloatArray:
    """Low-pass `values` (n,), sampled every `step` [s], by a Butterworth of order 2 run both ways.

    `cutoff` [Hz] is that of one run, below half the sampling rate; n exceeds 9. Both ends are
    extended by their point reflection, and each run starts in the steady state of its first value.

    References
    ----------
    F. Gustafsson, Determining the initial states in forward-backward filtering, IEEE Transactions
    on Signal Processing 44 (1996).
    """
    head = 2.0 * values[0] - values[_PADDING:0:-1]
    tail = 2.0 * values[-1] - values[-2 : -_PADDING - 2 : -1]
    k = float(np.tan(np.pi * cutoff * step))
    scale = 1.0 / (1.0 + np.sqrt(2.0) * k + k**2)
    moving = scale * k**2 * np.array([1.0, 2.0, 1.0])
    recursive = np.array([1.0, 2.0 * scale * (k**2 - 1.0), scale * (1.0 - np.sqrt(2.0) * k + k**2)])
    forward = _filter(np.concatenate([head, values, tail]), moving, recursive)
    both = _filter(forward[::-1], moving, recursive)[::-1]
    return np.asarray(both[_PADDING:-_PADDING])


def _filter(values: FloatArray, moving: FloatArray, recursive: FloatArray) -> FloatArray:
    """Run the filter Σ recursive·y = Σ moving·x, at rest at the first value before it."""
    change = values - values[0]
    driven = np.convolve(change, moving)[: change.size]
    bands = np.repeat(recursive[:, None], change.size, axis=1)
    return np.asarray(values[0] + solve_banded((2, 0), bands, driven))
