# SPDX-License-Identifier: MIT
"""Agreement of a simulated with a measured signal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray


@dataclass(frozen=True)
class SignalFit:
    """Agreement of simulation and measurement in one phase of one signal (THEORY section 4)."""

    rmse: float
    fit_percent: float


def compute_fit(measured: FloatArray, simulated: FloatArray, mean: FloatArray | float) -> SignalFit:
    """Rmse and fit % = 100·(1 - ‖y - ŷ‖/‖y - mean‖) (THEORY section 4); arrays (n,), SI.

    `mean` is that of the log, or of each sample's log (n,) where samples of several are pooled.
    NaN where there are no samples; a constant measurement has no fit %.
    """
    if measured.size == 0:
        return SignalFit(float("nan"), float("nan"))
    miss = float(np.linalg.norm(measured - simulated))
    spread = float(np.linalg.norm(measured - mean))
    percent = 100.0 * (1.0 - miss / spread) if spread > 0.0 else float("nan")
    return SignalFit(miss / float(np.sqrt(measured.size)), percent)
