# SPDX-License-Identifier: MIT
"""Removal of input noise that lies above the band of the actuators.

A valve and a clutch volume are slow, sensor noise is not. Noise left on a pressure that drives the
simulation makes elements lock and break away many times where the real one did so once, adds up to
0.4·σ to max(0, P - P0) about the fill point, and, since it enters the derivatives too, favours
parameters that attenuate it (Jo′ before all). A local cubic takes off what lies above the
actuator's band. About P0, where what is left would still open and close the element, more is taken
off a pressure that stays or goes evenly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray
from drivetwin.likelihood.measured_signal import MeasuredSignal
from drivetwin.vehicle.spec import PriorValue

CUBIC = 3


@dataclass(frozen=True)
class InputSmoothingSettings:
    """Settings of the removal of input noise."""

    window: float = 0.015
    """Length of the local cubic, which passes what a valve can do, up to about 60 Hz [s]."""
    longer_windows: tuple[float, ...] = (0.03, 0.06, 0.12, 0.24)
    """Lengths of the cubics that are tried about P0 [s]."""
    cubic_sigma: float = 1.5
    """Half width of the interval of the middle of a cubic, in its standard deviations: the
    intervals of all shorter cubics must overlap. Narrower than that of means, because a cut corner
    opens the element elsewhere [-]."""
    least_samples: int = 13
    """Samples of the shortest cubic of an input whose delay may be sought, odd: it leaves 42 % of
    the noise, and 2 % of the power of its differences [count]."""
    fill_sigma: float = 3.0
    """Distance from P0, in the noise of a sample, within which noise may open or close the element
    [-]."""
    corner_sigma: float = 5.0
    """Distance of a sample from the local cubic that shows a corner, in standard deviations [-]."""
    gap_ratio: float = 1.5
    """Distance of samples, over the usual one, above which samples are missing [-]."""
    half_widths: tuple[int, ...] = (0, 1, 2, 4, 8, 16, 32, 64)
    """Windows of the local mean: samples to either side [-]."""
    mean_sigma: float = 2.5
    """Half width of the interval of a mean, in its standard deviations; of a cubic where the effect
    of a corner that it cuts is returned linearly (`select_windows`) [-]."""


SMOOTHING = InputSmoothingSettings()


def smooth_pressure(pressure: MeasuredSignal, fill: PriorValue | None = None) -> FloatArray:
    """Remove the fast noise of a pressure (n,); corners too sharp for a local cubic stay as read.

    `fill` is P0 [Pa] as the card has it: about it the noise is taken off that a longer cubic takes.
    Pressure noise about P0 gives the fit many minima. In each of them the noise switches the torque
    on and off, which is mistaken for information that separates P0 from μ. At 5 kPa above P0 an
    estimate may be four standard deviations off.
    """
    values, shortest = pressure.values, _count_samples(pressure.time)
    smooth = smooth_windows(values, build_valve_windows(pressure.time))
    apart = np.abs(values - smooth) > SMOOTHING.corner_sigma * pressure.sigma
    if fill is not None:
        sizes = [shortest, *_list_longer(pressure.time, shortest)]
        windows = _select_windows(pressure, sizes, SMOOTHING.cubic_sigma)
        steady = smooth_windows(values, windows)
        band = SMOOTHING.fill_sigma * pressure.sigma + 2.0 * fill.std
        smooth = np.where(np.abs(steady - fill.value) < band, steady, smooth)
    return np.where(_spread(apart, shortest), values, smooth)


def build_valve_windows(time: FloatArray) -> NDArray[np.intp]:
    """Return the number of samples (n,) of the cubic over `SMOOTHING.window` about each sample, 1
    where they are too few for it."""
    size = _count_samples(time)
    return np.full(time.size, size if size <= time.size else 1, dtype=np.intp)


def select_windows(signal: MeasuredSignal) -> NDArray[np.intp]:
    """Select the number of samples (n,) of the cubic about each sample of any input, 1 at a corner.

    Every level is treated as one at P0, because any element may have its kink there. Noise that is
    left on an input enters the derivative by its delay, where it is mistaken for information. A
    cubic takes off enough of it from `SMOOTHING.least_samples` on.
    """
    shortest = max(_count_samples(signal.time), SMOOTHING.least_samples)
    sizes = [1, shortest, *_list_longer(signal.time, shortest)]
    return _select_windows(signal, sizes, SMOOTHING.mean_sigma)


def smooth_windows(values: FloatArray, windows: NDArray[np.intp]) -> FloatArray:
    """Return the middle of the cubic over so many samples as `windows` (n,) has about each of
    `values` (n,)."""
    smooth = values.copy()
    for size in np.unique(windows[windows > CUBIC + 1]):
        inside = windows == size
        smooth[inside] = filter_local_cubic(values, int(size))[inside]
    return smooth


def _list_longer(time: FloatArray, shortest: int) -> list[int]:
    """List the numbers of samples of the longer windows, beyond the `shortest`."""
    every = [_count_samples(time, window) for window in SMOOTHING.longer_windows]
    return [size for size in every if size > max(shortest, CUBIC + 1)]


def _select_windows(signal: MeasuredSignal, sizes: Sequence[int], sigma: float) -> NDArray[np.intp]:
    """Select about each sample (n,) the longest cubic of increasing `sizes` whose interval of
    `sigma` overlaps those of all shorter ones (as `smooth_adaptive`)."""
    values = signal.values
    low, high = np.full(values.size, -np.inf), np.full(values.size, np.inf)
    windows, open_ = np.ones(values.size, dtype=np.intp), np.ones(values.size, dtype=bool)
    for size in sizes:
        if size > values.size:
            break
        trial = smooth_windows(values, np.full(values.size, size))
        margin = sigma * signal.sigma * _compute_noise_gain(size)
        low, high = np.maximum(low, trial - margin), np.minimum(high, trial + margin)
        open_ &= low <= high
        windows = np.where(open_, size, windows)
    return windows


def _compute_noise_gain(size: int) -> float:
    """Compute the noise of the middle of a cubic over `size` samples, over that of a sample."""
    if size <= CUBIC + 1:
        return 1.0
    return float(np.linalg.norm(_compute_cubic_weights(size)[size // 2]))


def compute_bend(time: FloatArray, values: FloatArray) -> FloatArray:
    """Compute the correction (n,) that gives samples joined by straight lines the mean of a curve.

    Chords lie inside a curve, by h²/12 of its second derivative in the mean: in an engine torque
    that comes every 20 ms that is as much as its noise, and always to the same side. Nothing beside
    a gap.
    """
    step = np.diff(time)
    before, after = step[:-1], step[1:]
    second = 2.0 * np.diff(np.diff(values) / step) / (before + after)
    even = np.maximum(before, after) < SMOOTHING.gap_ratio * np.median(step)
    return np.pad(np.where(even, -second * before * after / 12.0, 0.0), 1)


def _count_samples(time: FloatArray, window: float = SMOOTHING.window) -> int:
    """Return the odd number of samples in a `window` [s]."""
    return 2 * int(0.5 * window / float(np.median(np.diff(time)))) + 1


def smooth_adaptive(signal: MeasuredSignal) -> FloatArray:
    """Remove the noise of a signal (n,) by adaptive local averaging.

    At every sample the mean over the longest window that agrees with those over all shorter ones
    (intersection of confidence intervals; Goldenshluger and Nemirovski 1997).
    """
    values = signal.values
    low, high = np.full(values.size, -np.inf), np.full(values.size, np.inf)
    mean, open_ = values.copy(), np.ones(values.size, dtype=bool)
    for half in SMOOTHING.half_widths:
        padded = np.pad(values, half, mode="edge")
        total = np.cumsum(np.concatenate([[0.0], padded]))
        trial = (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
        margin = SMOOTHING.mean_sigma * signal.sigma / np.sqrt(2 * half + 1)
        low, high = np.maximum(low, trial - margin), np.minimum(high, trial + margin)
        open_ &= low <= high
        mean = np.where(open_, trial, mean)
    return np.asarray(mean)


def filter_local_cubic(values: FloatArray, size: int) -> FloatArray:
    """Return the middle of the cubic over `size` samples, odd, about each of `values` (n,).

    At both ends the first and the last cubic are read off (Savitzky and Golay 1964). Written here,
    as the import of SciPy's takes longer than a fit.
    """
    weights = _compute_cubic_weights(size)
    half = size // 2
    smooth = np.empty(values.size)
    smooth[half : values.size - half] = np.convolve(values, weights[half][::-1], mode="valid")
    smooth[:half] = weights[:half] @ values[:size]
    smooth[values.size - half :] = weights[half + 1 :] @ values[-size:]
    return smooth


def _compute_cubic_weights(size: int) -> FloatArray:
    """Return the weights (size, size) by which samples give a cubic at each of them."""
    powers = np.vander(np.linspace(-1.0, 1.0, size), CUBIC + 1)
    orthogonal = np.linalg.qr(powers).Q
    return np.asarray(orthogonal @ orthogonal.T)


def _spread(marked: NDArray[np.bool_], size: int) -> NDArray[np.bool_]:
    """Mark all samples within `size`, odd, about a marked one (n,)."""
    return np.convolve(marked, np.ones(size), mode="same") > 0.5
