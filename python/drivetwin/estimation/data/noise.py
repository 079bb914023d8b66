# SPDX-License-Identifier: MIT
"""Noise level of a channel, from the log itself.

A driveline signal is smooth over a few samples at the logger's rate, so its third difference is
nearly all noise. Blocks in which the signal itself bends sharply stand out and are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray

_THIRD_DIFFERENCE_GAIN = np.sqrt(20.0)
"""Standard deviation of the third difference of unit white noise: sqrt(1 + 9 + 9 + 1)."""


@dataclass(frozen=True)
class NoiseSettings:
    """Settings of the estimate of white noise from third differences."""

    clip: float = 3.0
    """Deviates beyond this are corners of the signal, not noise [standard deviations]."""
    passes: int = 10
    """Passes of clipping [count]."""


NOISE = NoiseSettings()


_INNER_POWER = 0.97334
"""Variance of unit normal deviates cut at 3 sigma."""


def estimate_white_noise(values: FloatArray, block: int = 25, spread: float = 3.0) -> float:
    """Standard deviation of the sample-to-sample noise of `values` (n,), in their unit.

    The mean square of the third difference is averaged over the blocks of `block` samples whose
    own mean square is at most `spread` times the median's, without the single corners that stand
    out of it. Rounding counts as noise.
    """
    third = np.diff(values, 3) / _THIRD_DIFFERENCE_GAIN
    count = third.size // block
    if count < 2:
        return float(np.sqrt(np.mean(third**2)))
    blocks = third[: count * block].reshape(count, block) ** 2
    power = np.mean(blocks, axis=1)
    return _compute_clipped_rms(blocks[power <= spread * np.median(power)].ravel())


def _compute_clipped_rms(squares: FloatArray) -> float:
    """Root mean of squares (n,) of normal deviates, those beyond `_CLIP` sigma left out."""
    level = float(np.mean(squares))
    for _ in range(NOISE.passes):
        inner = squares[squares <= NOISE.clip**2 * level]
        level = float(np.mean(inner)) / _INNER_POWER
    return float(np.sqrt(level))
