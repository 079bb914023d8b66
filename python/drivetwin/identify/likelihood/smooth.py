# SPDX-License-Identifier: MIT
"""Inputs without the part of their noise that the driveline never had.

A valve and a clutch volume are slow, sensor noise is not. Noise left on a pressure that drives the
simulation makes elements lock and break away many times where the real one did so once, adds up to
0.4·σ to max(0, P - P0) about the fill point, and, since it enters the derivatives too, favours
parameters that attenuate it (Jo′ before all). A local cubic takes off what lies above the
actuator's band.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.signal import savgol_filter

from drivetwin.identify.signals import FloatArray, Sampled

WINDOW = 0.015
"""Length of the local cubic [s]: it passes what a valve can do, up to about 60 Hz."""
CUBIC = 3
CORNER = 5.0
"""Distance of a sample from the local cubic, in standard deviations, that shows a corner."""
GAP = 1.5
"""Distance of samples over the usual one from which on something is missing between them."""
HALF_WIDTHS = (0, 1, 2, 4, 8, 16, 32, 64)
"""Windows tried by the local mean: so many samples on either side."""
INTERVAL = 2.5
"""Half width of an interval in standard deviations of its mean."""


def smooth_pressure(pressure: Sampled) -> FloatArray:
    """Pressure (n,) without its fast noise; as read about corners too sharp for a local cubic."""
    smooth = local_cubic(pressure.time, pressure.values)
    apart = np.abs(pressure.values - smooth) > CORNER * pressure.sigma
    return np.where(maximum_filter1d(apart, _samples(pressure.time)), pressure.values, smooth)


def local_cubic(time: FloatArray, values: FloatArray) -> FloatArray:
    """Values (n,) of cubics over `WINDOW` about each sample (Savitzky and Golay 1964).

    The values as they are where the window holds too few samples for a cubic.
    """
    size = _samples(time)
    if size <= CUBIC + 1 or size > values.size:
        return values
    return np.asarray(savgol_filter(values, size, CUBIC), dtype=np.float64)


def bend_of(time: FloatArray, values: FloatArray) -> FloatArray:
    """What to add to samples (n,) so that, joined by straight lines, they have the mean of a curve.

    Chords lie inside a curve, by h²/12 of its second derivative in the mean: in an engine torque
    that comes every 20 ms that is as much as its noise, and always to the same side. Nothing beside
    a gap.
    """
    step = np.diff(time)
    before, after = step[:-1], step[1:]
    second = 2.0 * np.diff(np.diff(values) / step) / (before + after)
    even = np.maximum(before, after) < GAP * np.median(step)
    return np.pad(np.where(even, -second * before * after / 12.0, 0.0), 1)


def _samples(time: FloatArray) -> int:
    """Odd number of samples in `WINDOW`."""
    return 2 * int(0.5 * WINDOW / float(np.median(np.diff(time)))) + 1


def local_mean(signal: Sampled) -> FloatArray:
    """Signal (n,) without its noise, as far as the noise level allows to tell it.

    At every sample the mean over the longest window that agrees with those over all shorter ones
    (intersection of confidence intervals; Goldenshluger and Nemirovski 1997).
    """
    values = signal.values
    low, high = np.full(values.size, -np.inf), np.full(values.size, np.inf)
    mean, open_ = values.copy(), np.ones(values.size, dtype=bool)
    for half in HALF_WIDTHS:
        padded = np.pad(values, half, mode="edge")
        total = np.cumsum(np.concatenate([[0.0], padded]))
        trial = (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
        margin = INTERVAL * signal.sigma / np.sqrt(2 * half + 1)
        low, high = np.maximum(low, trial - margin), np.minimum(high, trial + margin)
        open_ &= low <= high
        mean = np.where(open_, trial, mean)
    return np.asarray(mean)
