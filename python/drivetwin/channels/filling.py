# SPDX-License-Identifier: MIT
"""Channels that another tool filled up by interpolation, and the samples that were measured.

A tool that resamples a slow signal onto the stamps of faster ones puts interpolated values between
the measured ones. Counted as samples they pretend to an accuracy that the sensor does not have. The
measured samples are the knots of a piecewise polynomial. Two hypotheses about a record compete by
their evidence, the logarithm of the ratio of their probabilities:

- straight lines between knots at any rows (`line_corners`): a row between knots lies on the line
  through its neighbours within the resolution of the numbers, so that the rows off that line are
  the knots. Their instants follow a raster with jitter. Rows of a measured record leave the line
  by chance (a Markov chain), or it was computed of straight stretches, whose lengths have no scale;
- a cubic or linear spline with knots on a regular raster, at or between rows (`knot_fit`): knots
  on the raster explain the record better than those half a period away, and further knots between
  them explain nothing more. For a measured record each part prefers either raster by chance.

A signal that a logger had repeated before a tool filled it up by lines is a third case: stairs with
ramps of a few rows. With the value before it in each row of a ramp the record is that of a held
signal, whose updates `update_raster` finds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from drivetwin._util.arrays import (
    FloatArray,
    compute_median_step,
    find_largest,
    find_run_bounds,
    find_true_runs,
    is_time_axis,
    remember_for_arrays,
)
from drivetwin.channels.knot_fit import MIN_KNOTS, KnotRaster, extend_knots, find_raster_of_knots
from drivetwin.channels.line_corners import (
    PRIOR,
    ROUND_OFF,
    LineKnots,
    estimate_resolution,
    find_corners,
    has_short_lines,
    list_blurs,
)
from drivetwin.channels.update_raster import find_raster, find_updates

_WINDOW, _LINES_WINDOW, _WINDOWS = 8192, 65536, 4
"""Rows of a window that is searched for a raster or for straight lines, and windows of a long
record [count]: cost of work."""
_CYCLE = 2048
"""Changes that show whether numbers repeat in turn [count]: cost of work."""
_LARGEST = 1e150
"""Magnitude of a damaged value, whose square overflows."""
_STRIDES = (2, 4, 8)
"""Rows from one that is looked at to the next [count]: rounding hides the bend of close ones."""
_LAGS = (1, 3, 9)
"""Rows over which bends are taken [count]: rounding hides those over a few rows."""
_BESIDE = 16
"""Lines of a spectrum on each side that show its level [count]."""
_CHANCE = 1e-9
"""Probability from which on chance may have made a line of a spectrum: cost of work."""
_STRAY = 0.05
"""Share of the steps of stairs that may have other lengths: updates of two rows in turn [1]."""
_PERIODS = 12
"""Most periods tried [count]: cost of work."""


class Interpolation(StrEnum):
    """Interpolation between measured samples."""

    LINEAR = "linear"
    CUBIC = "cubic"
    STEPS = "repetition and linear"
    UNKNOWN = "unknown"


@dataclass(frozen=True, eq=False)
class Filling:
    """Measured samples of a filled channel: instants `time` [s] (m,) and `values` (m,).

    `period` [s] is the median distance of the knots, `step` [s] that of the record. Both arrays
    are empty where the knots could not be found (`interpolation` UNKNOWN).
    """

    interpolation: Interpolation
    period: float
    step: float
    time: FloatArray
    values: FloatArray


@remember_for_arrays
def find_filling(time: FloatArray, values: FloatArray) -> Filling | None:
    """Find the measured samples of a channel that was filled up.

    Parameters
    ----------
    time : FloatArray, shape (n,)
        Stamps [s], strictly increasing.
    values : FloatArray, shape (n,)
        Values of the record; NaN where there is none.

    Returns
    -------
    Filling or None
        None where each sample may be measured, or the signal was only repeated.
    """
    if not find_largest(values) < _LARGEST:  # NaN is not below
        usable = np.abs(values) < _LARGEST
        time, values = time[usable], values[usable]
    if time.size < 2 * MIN_KNOTS or not is_time_axis(time):
        return None
    stairs = _find_stairs(time, values)
    if stairs is not None or find_raster(time, values) is not None:
        return stairs
    if _is_cycle(_list_first_changes(values)):
        return None
    step = compute_median_step(time)
    lines = _find_lines(time, values)
    if lines is not None:
        return Filling(Interpolation.LINEAR, lines.period, step, lines.time, lines.values)
    for part in _list_windows(time, values):
        raster = _find_raster(time[part], values[part])
        filling = None if raster is None else _extend_raster(time, values, raster)
        if filling is not None:
            return filling
    for stride in _STRIDES if len(list_blurs(time)) > 1 else ():
        lines = _find_lines(time[::stride], values[::stride])
        if lines is not None:
            return Filling(Interpolation.LINEAR, lines.period, step, lines.time, lines.values)
    nothing = np.empty(0)
    unknown = Filling(Interpolation.UNKNOWN, np.nan, step, nothing, nothing)
    parts = _list_liveliest(values, _cut(0, time.size, _LINES_WINDOW))
    return unknown if any(has_short_lines(time[part], values[part]) for part in parts) else None


def _find_stairs(time: FloatArray, values: FloatArray) -> Filling | None:
    """Find the updates of stairs whose steps are ramps of a few rows, all of as many but one.

    A ramp ends at its update. It lasts for the step of the table that was filled up, and the value
    of its last row shows how much of it is left.
    """
    slopes, step = np.diff(values), compute_median_step(time)
    starts, ends = find_run_bounds(slopes != 0.0)
    rows = ends - starts
    if starts.size < MIN_KNOTS or 2 * np.sum(rows) > slopes.size:
        return None
    left = slopes[ends - 1] / (values[ends] - values[starts] + (values[ends] == values[starts]))
    shortest = int(np.quantile(rows, _STRAY))
    usual = (rows >= shortest) & (rows <= shortest + 1) & (left > 0.0) & (left <= 1.0)
    ramps = usual & (rows > 1)
    if np.mean(usual) < 1.0 - _STRAY or 2 * np.count_nonzero(ramps) < starts.size:
        return None
    held = values.copy()
    for start, end in zip(starts[ramps].tolist(), ends[ramps].tolist(), strict=True):
        held[start:end] = values[start]
    # Of a ramp at an end of the record the length is unknown.
    first = ends[0] if starts[0] == 0 else 0
    end = starts[-1] + 1 if ends[-1] == slopes.size else time.size
    time, held = time[first:end], held[first:end]
    raster, found = find_raster(time, held), find_updates(time, held)
    if raster is None or found is None:
        return None
    lasts = step * float(np.mean(rows[usual] - 1.0))
    early = step - lasts * float(np.median(left[ramps])) if raster.early == 0.0 else 0.0
    instants, samples = found
    return Filling(Interpolation.STEPS, raster.period, step, instants - early, held[samples])


def _find_lines(time: FloatArray, values: FloatArray) -> LineKnots | None:
    """Find knots of straight lines; in a long record only where one of its windows has some."""
    parts = _list_liveliest(values, _cut(0, time.size, _LINES_WINDOW))
    if len(parts) > 1 and all(find_corners(time[part], values[part]) is None for part in parts):
        return None
    return find_corners(time, values)


def _cut(first: int, end: int, length: int) -> list[slice]:
    """Cut the rows from `first` to `end` (excluded) into windows of a `length`."""
    return [slice(start, min(start + length, end)) for start in range(first, end, length)]


def _list_liveliest(values: FloatArray, parts: Sequence[slice]) -> list[slice]:
    """List the windows with the most changes, the liveliest first."""
    changes = [np.count_nonzero(values[part][1:] != values[part][:-1]) for part in parts]
    liveliest = np.argsort(-np.asarray(changes), kind="stable")[:_WINDOWS]
    return [parts[k] for k in liveliest if changes[k] >= MIN_KNOTS]


def _list_windows(time: FloatArray, values: FloatArray) -> list[slice]:
    """List evenly sampled stretches, the liveliest of a long record first."""
    runs = _find_even_runs(time)
    return _list_liveliest(
        values, [part for first, end in runs for part in _cut(first, end + 1, _WINDOW)]
    )


@remember_for_arrays
def _find_even_runs(time: FloatArray) -> list[tuple[int, int]]:
    """Return first and last row of each evenly sampled stretch."""
    step = compute_median_step(time)
    return find_true_runs(np.abs(np.diff(time) - step) < 0.5 * step, 8 * MIN_KNOTS)


def _find_raster(time: FloatArray, values: FloatArray) -> KnotRaster | None:
    """Find the regular raster of knots in an evenly sampled stretch."""
    step = float(time[-1] - time[0]) / (time.size - 1)
    periods = [step * period for period in _list_periods(values)]
    return find_raster_of_knots(time, values, periods, estimate_resolution(values), PRIOR)


def _extend_raster(time: FloatArray, values: FloatArray, found: KnotRaster) -> Filling | None:
    """Return the knots of the whole record; `found` are those of a window.

    None where the rest of the record has no such knots.
    """
    step = compute_median_step(time)
    interpolation = Interpolation.LINEAR if found.is_linear else Interpolation.CUBIC
    if found.on_rows:
        count = np.round((time - found.start) / found.period)
        at = np.abs(time - found.start - count * found.period) < 0.5 * step
        return Filling(interpolation, found.period, step, time[at], values[at])
    knots, heights = extend_knots(time, values, found)
    return Filling(interpolation, found.period, step, knots, heights) if knots.size else None


def _list_first_changes(values: FloatArray) -> FloatArray:
    """Return the first values that differ from those before, at most `_CYCLE`."""
    for rows in (8 * _CYCLE, values.size):
        first = values[:rows]
        changed = np.flatnonzero(first[1:] != first[:-1])[:_CYCLE] + 1
        if changed.size == _CYCLE:
            break
    return np.asarray(values[changed])


def _is_cycle(values: FloatArray) -> bool:
    """Return True if the record goes round a few values, as parameter numbers that a bus sends.

    Interpolated samples are nearer to their neighbours than to samples of other knots. In a cycle
    of N numbers they are nearer to those of a round before, and neighbours are apart by 4/N of the
    largest distance at any lag (rising numbers) or more; an oscillation of P samples has pi/P. If
    knots reproduce one round they reproduce all, which is no further evidence.
    """
    most = values.size // 4
    if most < 1:
        return False
    apart = [float(np.mean(np.abs(values[lag:] - values[:-lag]))) for lag in range(1, most + 1)]
    return min(apart) < apart[0] > 0.25 * max(apart)


def _list_periods(values: FloatArray) -> list[float]:
    """List possible periods [samples] of the knots, longest first.

    A linear filling shows in second differences, a cubic one in fourth; over several samples, as
    rounding hides the bend from one to the next.
    """
    peaks: list[tuple[float, float]] = []
    for order in (2, 4):
        nothing = 2.0**order * ROUND_OFF * float(np.abs(values).max())
        for lag in _LAGS:
            if order * lag < values.size // 4:
                bends = np.abs(_difference(values, order, lag))
                # The round-off of a straight record may repeat, too.
                bends[bends < nothing] = 0.0
                peaks += _find_peaks(bends)
    peaks.sort(reverse=True)
    periods: list[float] = []
    for _, period in peaks:
        if all(abs(period - one) > 0.01 * one for one in periods):
            periods.append(period)
    # Of a cubic filling the line of half the period may be the strongest.
    strongest = periods[:_PERIODS]
    return sorted({*strongest, *(2.0 * one for one in strongest[:2])}, reverse=True)


def _difference(values: FloatArray, order: int, lag: int) -> FloatArray:
    """Return the differences of an `order` over `lag` samples."""
    for _ in range(order):
        values = values[lag:] - values[:-lag]
    return values


def _find_peaks(bends: FloatArray) -> list[tuple[float, float]]:
    """Return height and period [samples] of the lines in the spectrum of `bends`.

    Ranks instead of sizes, so that a shift does not outshine the rest of the record.
    """
    from scipy.ndimage import median_filter

    _, inverse, count = np.unique(bends, return_inverse=True, return_counts=True)
    ranks = (np.cumsum(count) - 0.5 * count)[inverse]
    ranks -= ranks.mean()
    power = np.abs(np.fft.rfft(ranks * np.hanning(ranks.size))) ** 2
    # Relative to the lines beside: shifts and rest raise the low frequencies as a whole.
    level = median_filter(power, 2 * _BESIDE + 1, mode="mirror") / np.log(2.0)
    power = np.divide(power, level, out=np.zeros_like(power), where=level > 0.0)
    high = power > np.log(power.size / _CHANCE)
    longest = bends.size / MIN_KNOTS
    peaks = []
    for first, end in find_true_runs(high):
        top = first + int(np.argmax(power[first:end]))
        frequency = _refine_peak(power, top) / ranks.size
        if frequency * longest > 1.0:
            peaks.append((float(power[top]), 1.0 / frequency))
    return peaks


def _refine_peak(power: FloatArray, top: int) -> float:
    """Return the position of a maximum of `power` between its samples, by a parabola of logs."""
    if not 0 < top < power.size - 1 or power[top - 1 : top + 2].min() <= 0.0:
        return float(top)
    left, middle, right = np.log(power[top - 1 : top + 2])
    bend = left - 2.0 * middle + right
    return top + (0.5 * float((left - right) / bend) if bend < 0.0 else 0.0)
