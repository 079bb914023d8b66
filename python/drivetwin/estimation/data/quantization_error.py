# SPDX-License-Identifier: MIT
"""Mean error of a rounded signal at its levels, by the likelihood of its codes.

A signal that rests at the level L with noise of standard deviation σ reads the code k of the
rounding step q with the probability

    P(k) = Φ((k + ½ - L/q)·q/σ) - Φ((k - ½ - L/q)·q/σ)

The counts of the codes give the likelihood of L and σ: interval censoring. The mean error of the
code is β(L, σ) = q·Σ k·P(k) - L. Noise of half a step dithers it; without noise it is a uniform
error of the level.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp, ndtr

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.data.shift_data import MeasuredSignal


@dataclass(frozen=True)
class QuantizationSettings:
    """Settings of the mean error of a rounded signal."""

    block: int = 25
    """Samples of one piece that may be a level, as for white noise [count]."""
    farthest_code: int = 6
    """Distance of the codes of a level from their median [rounding steps]."""
    max_drift: float = 1.0
    """Change of the mean between the halves of a piece below which it is a level [steps]."""
    outlier: float = 4.5
    """Fall of the log likelihood at which a piece counts as no level: three standard deviations."""
    negligible: float = 1e-3
    """Mean error over the noise of a sample that is negligible [ratio]: in the mean of a thousand
    samples it is thirty times as large."""


QUANTIZATION = QuantizationSettings()
_SIGMA = np.geomspace(0.003, 1.5, 40)
"""Noise before rounding [rounding steps], equally likely beforehand."""
_LEVEL = np.linspace(-1.5, 1.5, 61)
"""Level from the median code [rounding steps], equally likely beforehand."""


def estimate_quantization_error(signal: MeasuredSignal, step: float) -> float:
    """Estimate the standard deviation of the mean error that rounding to `step` leaves at a level.

    Root mean square of β over all levels and over the posterior of L and σ, in the signal's unit.
    0 where no step shows, where noise dithers it, and where the signal rests at no level.
    """
    if step == 0.0:
        return 0.0
    counts = _count_codes(signal.values, step)
    if not len(counts):
        return 0.0
    codes = np.arange(-QUANTIZATION.farthest_code, QUANTIZATION.farthest_code + 1)
    distance = codes - _LEVEL[:, None]
    sigma = _SIGMA[:, None, None]
    chance = ndtr((distance + 0.5) / sigma) - ndtr((distance - 0.5) / sigma)
    bias = chance @ codes - _LEVEL
    log_chance = np.log(np.maximum(chance, np.finfo(float).tiny))
    likelihood = np.einsum("bk,slk->bsl", counts, log_chance)
    error = np.sqrt(_average_square(bias, likelihood)) * step
    return float(error) if error > QUANTIZATION.negligible * signal.sigma else 0.0


def _count_codes(values: FloatArray, step: float) -> FloatArray:
    """Count the codes (b, 2·farthest_code + 1) about the median of each piece that is a level."""
    size = min(QUANTIZATION.block, values.size)
    pieces = np.round((values[: values.size // size * size] - values[0]) / step).reshape(-1, size)
    codes = pieces - np.median(pieces, axis=1).round()[:, None]
    half = size // 2
    drift = np.abs(codes[:, :half].mean(axis=1) - codes[:, half:].mean(axis=1))
    far = QUANTIZATION.farthest_code
    level = (np.abs(codes).max(axis=1) <= far) & (drift < QUANTIZATION.max_drift)
    reached = np.arange(-far, far + 1)
    return np.asarray((codes[level, :, None] == reached).sum(axis=1), dtype=float)


def _average_square(bias: FloatArray, likelihood: FloatArray) -> float:
    """Average the squared `bias` (s, l) over the posterior of noise and level.

    `likelihood` (b, s, l) is the logarithm for each level; a piece that fits no common noise counts
    as an outlier.
    """
    by_noise = logsumexp(likelihood, axis=2)
    fall = np.maximum(by_noise - by_noise.max(axis=1, keepdims=True), -QUANTIZATION.outlier)
    total = fall.sum(axis=0)
    of_noise = np.exp(total - logsumexp(total))
    of_level = np.exp(likelihood - by_noise[:, :, None])
    square = np.mean(np.sum(of_level * bias**2, axis=2), axis=0)
    return float(of_noise @ square)
