# SPDX-License-Identifier: MIT
"""Compared signal of a record: samples at instants, or means over their period; agreement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray
from drivetwin.likelihood.sample_noise import Quantization

IndexArray = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Output:
    """A compared signal: `values` (n,) stamped at the points `place` (n,) of the record's grid.

    `sigma` is the white noise of a sample, `rounding` are errors that this noise does not dither.
    With a `window` [s] a sample is the mean over that time before its stamp, as encoders on a bus
    send it. `centre` (n,) are the points in the middle of what a sample shows. `least_sigma` is the
    noise down to which the residual of a fit may lower `sigma`; infinite where that is stated.
    """

    name: str
    place: IndexArray
    values: FloatArray
    sigma: float
    window: float = 0.0
    centre: IndexArray = field(default_factory=lambda: np.empty(0, dtype=np.intp))
    rounding: Quantization | None = None
    least_sigma: float = np.inf

    def __post_init__(self) -> None:
        """Without a window the middle is the stamp."""
        if self.window == 0.0:
            object.__setattr__(self, "centre", self.place)

    def cut(self, count: int) -> Output:
        """Keep the samples stamped within the first `count` points of the grid."""
        return self.select(slice(int(np.searchsorted(self.place, count))))

    def select(self, kept: slice) -> Output:
        """Keep the samples in a slice."""
        return replace(
            self,
            place=self.place[kept],
            values=self.values[kept],
            centre=self.centre[kept],
            rounding=self.rounding and self.rounding.select(kept),
        )

    @property
    def noise(self) -> FloatArray:
        """Standard deviation (n,) of white noise with the power of a sample's own and of its
        rounding."""
        rounding = 0.0 if self.rounding is None else self.rounding.sigma
        return np.full(self.values.size, np.hypot(self.sigma, rounding))

    def get_period(self, time: FloatArray) -> float:
        """Return the sampling time [s]."""
        return float(np.median(np.diff(time[self.place])))

    def drop_first_period(self, time: FloatArray) -> Output:
        """Keep the samples stamped a period or more after the grid `time` (N,) starts: point
        samples and means are then both defined on it."""
        first = int(np.searchsorted(time[self.place], time[0] + self.get_period(time)))
        return self.select(slice(first, None))

    def convert_to_means(self, time: FloatArray) -> Output:
        """Interpret the samples as means over the time since the previous one."""
        window = self.get_period(time)
        centre = np.searchsorted(time, time[self.place] - 0.5 * window)
        return replace(self, window=window, centre=centre)

    def find_begin(self, time: FloatArray) -> IndexArray:
        """Find the points (n,) of the grid at which the time of each sample begins."""
        begin = time[self.place] - self.window
        after = np.clip(np.searchsorted(time, begin), 1, time.size - 1)
        return np.asarray(after - (begin - time[after - 1] < time[after] - begin))

    def sample(self, time: FloatArray, column: FloatArray) -> FloatArray:
        """Sample a quantity (N,) on the grid `time` (N,) as this sensor does; shape (n,).

        Also several quantities, (N, k) to (n, k).
        """
        if self.window == 0.0:
            return column[self.place]
        return _compute_means(time, column, self.place, self.window)

    def sample_other_mode(self, time: FloatArray, column: FloatArray) -> FloatArray:
        """Sample a quantity in the other mode (n,): means instead of point samples, or the
        reverse."""
        if self.window > 0.0:
            return column[self.place]
        return _compute_means(time, column, self.place, self.get_period(time))


def _compute_means(
    time: FloatArray, columns: FloatArray, place: IndexArray | slice, window: float
) -> FloatArray:
    """Compute means (n, ...) of quantities (N, ...) over the `window` [s] before the points `place`
    of the grid `time` (N,); before the grid they are constant."""
    shape = (-1, *[1] * (columns.ndim - 1))
    step = np.diff(time).reshape(shape)
    sums = np.cumsum(0.5 * (columns[1:] + columns[:-1]) * step, axis=0)
    total = np.concatenate([np.zeros_like(columns[:1]), sums])
    begin = time[place] - window
    first = np.clip(np.searchsorted(time, begin) - 1, 0, time.size - 1)
    ends = columns[first] + _interpolate(time, columns, begin)
    before = total[first] + 0.5 * (begin - time[first]).reshape(shape) * ends
    return np.asarray((total[place] - before) / window)


def _interpolate(time: FloatArray, columns: FloatArray, at: FloatArray) -> FloatArray:
    """Interpolate quantities (N, ...) over the grid `time` (N,) at instants; constant beyond."""
    after = np.clip(np.searchsorted(time, at), 1, time.size - 1)
    share = np.clip((at - time[after - 1]) / (time[after] - time[after - 1]), 0.0, 1.0)
    share = share.reshape(-1, *[1] * (columns.ndim - 1))
    return np.asarray((1.0 - share) * columns[after - 1] + share * columns[after])


class ComparedOutputs:
    """Samples of the outputs of a record on the grid `time` (N,) [s], stacked in their order."""

    time: FloatArray
    outputs: tuple[Output, ...]

    def sample(self, columns: Mapping[str, FloatArray]) -> FloatArray:
        """Sample quantities (N,) or (N, p) on the grid, by name; (size,) or (size, p)."""
        return np.concatenate([out.sample(self.time, columns[out.name]) for out in self.outputs])

    @property
    def size(self) -> int:
        """Number of compared samples."""
        return sum(out.values.size for out in self.outputs)

    @cached_property
    def sigma(self) -> FloatArray:
        """Standard deviation of each compared sample (size,)."""
        return np.concatenate([out.noise for out in self.outputs])

    @property
    def measured(self) -> FloatArray:
        """Compared samples, stacked (size,)."""
        return np.concatenate([out.values for out in self.outputs])


@dataclass(frozen=True)
class Channel:
    """Measured quantity of a quantity x: `gain` · x + `curve` · x·|x| + `offset`, with x at
    t - `delay`; where it `is_mean`, with the mean of x over twice the delay before t."""

    gain: float = 1.0
    offset: float = 0.0
    delay: float = 0.0
    curve: float = 0.0
    is_mean: bool = False

    def delay_columns(self, time: FloatArray, columns: FloatArray) -> FloatArray:
        """Delay quantities (N, ...) over the grid `time` (N,) [s]."""
        if self.delay == 0.0:
            return columns
        if self.is_mean and self.delay > 0.0:
            return _compute_means(time, columns, slice(None), 2.0 * self.delay)
        return _interpolate(time, columns, time - self.delay)

    def show(self, time: FloatArray, column: FloatArray) -> FloatArray:
        """Compute the measured quantity (N, ...) of a quantity over `time` (N,) [s]."""
        late = self.delay_columns(time, column)
        return np.asarray((self.gain + self.curve * np.abs(late)) * late + self.offset)

    def show_changes(self, time: FloatArray, changes: FloatArray, column: FloatArray) -> FloatArray:
        """Compute the changes (N, p) of the measured quantity by those of the quantity, which is
        `column` (N,) over `time` (N,) [s]."""
        slope = self.gain + 2.0 * self.curve * np.abs(column)
        return self.delay_columns(time, slope[:, None] * changes)

    def find_shown(self, out: Output, time: FloatArray) -> Output:
        """Return an output with its samples at the points of the grid `time` (N,) [s] that they
        show: earlier by the delay."""
        if self.delay == 0.0:
            return out
        place, centre = (
            np.minimum(np.searchsorted(time, time[one] - self.delay), time.size - 1)
            for one in (out.place, out.centre)
        )
        return replace(out, place=place, centre=centre)


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
