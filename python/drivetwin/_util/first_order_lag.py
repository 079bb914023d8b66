# SPDX-License-Identifier: MIT
"""First-order lag of an evenly sampled signal; spares the import of a library of filters."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_banded

from drivetwin._util.arrays import FloatArray


def apply_lag(values: FloatArray, step: float, time_constant: float) -> FloatArray:
    """Apply a first-order lag [s] to `values` (n,), sampled every `step` [s], at rest before them.

    The lag is solved exactly for an input that is linear between the samples.
    """
    decay = np.exp(-step / time_constant)
    mean = time_constant / step * (1.0 - decay)
    right = np.array(values, dtype=np.float64)
    right[1:] = (1.0 - mean) * values[1:] + (mean - decay) * values[:-1]
    bands = np.vstack([np.ones(right.size), np.full(right.size, -decay)])
    return np.asarray(solve_banded((1, 0), bands, right))
