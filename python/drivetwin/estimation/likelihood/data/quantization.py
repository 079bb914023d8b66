# SPDX-License-Identifier: MIT
"""Quantization errors of an input that its own noise does not dither.

While a torque or pressure stays at a level the error stays too: its mean over that time is as far
off as one sample, and noise of the same size that comes and goes from sample to sample would be far
less. Each stay has an error of its own, so what it does is that of white noise of the same power
there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.data.quantization_error import estimate_quantization_error
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.estimation.likelihood.data.input_smoothing import smooth_adaptive


@dataclass(frozen=True, eq=False)
class Quantization:
    """Errors of the samples of a rounded signal that do not average out.

    `error` is the standard deviation of the mean error of one stay at a level, in the signal's
    unit; `stay` (m,) the number of the stay that each sample belongs to, from 0.
    """

    error: float
    stay: NDArray[np.intp]

    @property
    def sigma(self) -> FloatArray:
        """White noise (m,) of the samples with the same power: its mean over a stay is `error`."""
        return np.asarray(self.error * np.sqrt(np.bincount(self.stay)[self.stay]))

    def draw(self, rng: np.random.Generator) -> FloatArray:
        """Draw random errors (m,)."""
        return np.asarray(self.error * rng.standard_normal(int(self.stay[-1]) + 1)[self.stay])


def estimate_quantization(signal: MeasuredSignal, step: float) -> Quantization | None:
    """Compute the errors that quantization to `step` leaves, in the signal's unit; None if noise
    dithers them."""
    error = estimate_quantization_error(signal, step)
    if error == 0.0:
        return None
    level = np.round(smooth_adaptive(signal) / step)
    return Quantization(error, np.cumsum(np.diff(level, prepend=level[0]) != 0.0))
