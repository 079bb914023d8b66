# SPDX-License-Identifier: MIT
"""Samples of one channel for the estimates, their noise, and the mean error of rounded levels.

A driveline signal is smooth over a few samples at the logger's rate, so its third difference is
nearly all noise. Blocks in which the signal itself bends sharply stand out and are left out.

A signal that rests at the level L with noise of standard deviation σ reads the code k of the
rounding step q with the probability

    P(k) = Φ((k + ½ - L/q)·q/σ) - Φ((k - ½ - L/q)·q/σ)

The counts of the codes give the likelihood of L and σ: interval censoring. The mean error of the
code is β(L, σ) = q·Σ k·P(k) - L. Noise of half a step dithers it; without noise it is a uniform
error of the level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import logsumexp, ndtr

from drivetwin._util.arrays import FloatArray, Span, estimate_rounding_step
from drivetwin.channels.shiftlog import Channel, find_pauses

_THIRD_DIFFERENCE_GAIN = np.sqrt(20.0)
"""Standard deviation of the third difference of unit white noise: sqrt(1 + 9 + 9 + 1)."""


@dataclass(frozen=True, eq=False)
class MeasuredSignal:
    """One signal: `time` (n,) s increasing, `values` (n,) SI, `sigma` white noise of a sample."""

    time: FloatArray
    values: FloatArray
    sigma: float = 0.0

    @cached_property
    def gaps(self) -> tuple[Span, ...]:
        """Spans [s] between samples across which nothing is interpolated."""
        return find_pauses(self.time)

    @property
    def unrecorded(self) -> tuple[Span, ...]:
        """Spans [s] without samples: the gaps, before the first sample and after the last."""
        if not self.time.size:
            return ((-np.inf, np.inf),)
        first, last = float(self.time[0]), float(self.time[-1])
        return ((-np.inf, first), *self.gaps, (last, np.inf))

    def interpolate_at_times(self, time: FloatArray) -> FloatArray:
        """Values at `time` (m,), linear between samples; NaN inside a gap."""
        values = np.interp(time, self.time, self.values)
        for start, end in self.gaps:
            values[(time > start) & (time < end)] = np.nan
        return values

    def select_span(self, span: Span) -> MeasuredSignal:
        """The samples inside `span` [s], both ends included."""
        keep = (self.time >= span[0]) & (self.time <= span[1])
        return MeasuredSignal(self.time[keep], self.values[keep], self.sigma)


@dataclass(frozen=True)
class NoiseSettings:
    """Settings of the estimate of white noise from third differences."""

    clip: float = 3.0
    """Deviates beyond this are corners of the signal, not noise [standard deviations]."""
    passes: int = 10
    """Passes of clipping [count]."""


NOISE = NoiseSettings()


_REPEAT_LAGS, _UNCORRELATED = 40, 0.05
"""Samples over which a residual is correlated at most, and the correlation that counts as none."""


def count_repeats(parts: Sequence[FloatArray]) -> float:
    """Count the samples of residuals that carry the information of one independent sample.

    It is the time over which they are correlated: the sum of their autocorrelations over all
    `parts` (n_k,), at least 1.
    """
    lags = range(min(_REPEAT_LAGS, *(one.size for one in parts)))
    products = [
        np.mean([np.mean(one[lag:] * one[: one.size - lag]) for one in parts]) for lag in lags
    ]
    if products[0] == 0.0:
        return 1.0
    shares = np.array(products) / products[0]
    below = np.flatnonzero(shares < _UNCORRELATED)
    last = int(below[0]) if below.size else shares.size
    return float(max(1.0 + 2.0 * np.sum(shares[1:last]), 1.0))


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


@dataclass(frozen=True)
class FilteredNoiseSettings:
    """Settings of the estimate of noise behind a low-pass filter."""

    least_rate: float = 200.0
    """Rate to which samples are thinned [Hz]: third differences pass 3 % of an oscillation of 20
    Hz there."""
    growth: tuple[float, float] = (1.25, 7.0)
    """Growth of the noise of every second sample that shows a filter.
    White noise does not grow, a signal without noise by a factor of 8 [ratio]."""


FILTERED_NOISE = FilteredNoiseSettings()


def estimate_noise(time: FloatArray, values: FloatArray) -> float:
    """Estimate the standard deviation of white noise with the power of the noise of `values` (n,)
    at low frequencies.

    Behind a low-pass filter neighbouring samples have nearly the same noise, so that differences
    show hardly any. Samples are thinned until their noise no longer grows; one of them counts as
    much as the k that it stands for, whose white noise is √k times as large.
    """
    level, count = estimate_white_noise(values), 1
    rate = (time.size - 1) / float(np.ptp(time)) if time.size > 1 else 0.0
    low, high = FILTERED_NOISE.growth
    while rate >= 2 * count * FILTERED_NOISE.least_rate:
        thinned = estimate_white_noise(values[:: 2 * count])
        if not low * level < thinned < high * level:
            break
        level, count = thinned, 2 * count
    return level * float(np.sqrt(count))


def prepare_signal(channel: Channel, factor: float = 1.0) -> MeasuredSignal:
    """Return the finite updates of a channel times `factor`, with their noise."""
    updates = channel.updates
    finite = np.isfinite(updates.values)
    time, values = updates.time[finite], factor * updates.values[finite]
    step = estimate_rounding_step(values)
    # Rounding without noise grows in thinned samples as well, and has an estimate of its own.
    noise = estimate_white_noise(values)
    if noise > step:
        noise = estimate_noise(time, values)
    return MeasuredSignal(time, values, max(noise, float(step / np.sqrt(12.0))))


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
