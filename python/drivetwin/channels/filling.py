# SPDX-License-Identifier: MIT
"""Channels that another tool filled up by interpolation, and the samples that were measured.

A tool that resamples a slow signal onto a faster table puts interpolated values between the
measured ones. Counted as samples they pretend to an accuracy that the sensor does not have. The
measured samples are the knots of a piecewise polynomial. A filling is recognised by two facts: the
bend of the record repeats with the period of the knots, and the record is reproduced from its
knots at the right instants but not from instants half a period away.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray
from drivetwin._util.signal_processing import find_true_runs
from drivetwin._util.time_steps import (
    compute_median_step,
    is_time_axis,
    remember_for_arrays,
)
from drivetwin.channels.knot_fit import (
    ROUND_OFF,
    Interpolant,
    KnotFit,
    extend_knots,
    fit_off_grid,
    fit_on_grid,
)


class FillKind(StrEnum):
    """Interpolation between measured samples."""

    LINEAR = "linear"
    CUBIC = "cubic"
    UNKNOWN = "unknown"


@dataclass(frozen=True, eq=False)
class Filling:
    """Measured samples of a filled channel: instants `time` [s] (m,) and `values` (m,).

    `period` [s] is the median distance of the knots, `step` [s] that of the record. Both arrays
    are empty where the knots could not be found (kind UNKNOWN).
    """

    kind: FillKind
    period: float
    step: float
    time: FloatArray
    values: FloatArray


@dataclass(frozen=True)
class FillingSettings:
    """Settings of the search for interpolated samples."""

    window: int = 8192
    """Samples looked at together [count]; several seconds at 1 kHz."""
    windows: int = 4
    """Most windows of a long record that are searched [count]: a drive may begin at rest."""
    fitted: int = 2048
    """Samples in the middle of a window that knots are fitted to [count]."""
    least: int = 200
    """Fewest samples that can show a filling [count]."""
    least_knots: int = 16
    """Fewest knots within a window [count]."""
    lags: tuple[int, ...] = (1, 3, 9)
    """Samples over which bends are taken [count]."""
    beside: int = 16
    """Lines of the spectrum on each side that show its level [count]."""
    periods: int = 12
    """Most periods tried [count]."""
    cyclic: float = 0.25
    """Mean distance of neighbours over the largest at any lag, above which a record that repeats is
    a cycle of numbers: 4/N of N rising ones, about 1 in random order. An oscillation of P samples
    has pi/P, and may be that of a filled signal."""
    rounds: int = 4
    """Fewest rounds of such a cycle [count]."""
    chance: float = 1e-9
    """Probability from which on chance may have made a line of the spectrum of bends."""
    exact: float = 0.01
    """Contrast of the misfit to that of instants half a period away, below which the record is
    reproduced whatever its rounding: that of untouched channels is near one."""
    plain: float = 0.1
    """Contrast of a raster that was found, below which no other is tried."""
    significant: float = 0.85
    """Such a contrast where rounding alone explains the misfit ..."""
    significant_between: float = 0.7
    """... and where the knots lie between samples: their raster was searched for the least ..."""
    as_good: float = 1.2
    """Misfit relative to the least from which on a raster explains less ..."""
    nothing: float = 1e-6
    """... unless it is this part of the misfit half a period away."""
    rounding: float = 2.4
    """... at most this many variances of a rounded number: its own, and at most 1.3 of the knots
    that it was computed from."""
    noise: float = 0.6
    """Least noise of the knots [rounding steps] for that. Below, rounding is the noise of the
    channel, and no filling can be seen behind it."""
    covered: float = 0.9
    """Least share of the record that straight lines of three samples cover."""
    share: float = 0.3
    """Least share of moving samples without bend that shows such knots."""


FILLING = FillingSettings()

_LARGEST = 1e150
"""Magnitude of a damaged value, whose square overflows."""
_NO_BEND = 10.0
"""Bends below so many round-offs count as none."""
_BENDS_OF_A_KNOT = 2
"""Second differences of a record that a knot between two samples acts on [count]."""
_ROUNDED_BENDS = 2.5
"""Steps of rounding above which a second difference is no rounded straight line: it has up to two
[count]."""
_NOISE_LAGS = (1, 2, 3)
"""Lags of the differences that show the noise of the knots [count]."""
_MANY_LINES = 0.05
"""Straight parts per sample from which a record counts as filled up: one in twenty rows."""
_DEVIATION = 0.4
"""Distance of samples from their line, over the bends that rounding makes: one step."""


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
        None where each sample may be measured.
    """
    usable = np.abs(values) < _LARGEST
    if not usable.all():
        time, values = time[usable], values[usable]
    if time.size < FILLING.least or not is_time_axis(time):
        return None
    for part in _list_windows(time, values):
        found = _find_in_window(time[part], values[part])
        filling = None if found is None else _extend_filling(time, values, found)
        if filling is not None:
            return filling
    return None


def _list_windows(time: FloatArray, values: FloatArray) -> Iterator[slice]:
    """List evenly sampled stretches, the liveliest of a long record first."""
    step = compute_median_step(time)
    even = np.abs(np.diff(time) - step) < 0.5 * step
    parts = []
    for first, end in find_true_runs(even):
        for start in range(first, end + 1, FILLING.window):
            part = slice(start, min(start + FILLING.window, end + 1))
            if part.stop - part.start >= FILLING.least:
                parts.append(part)
    changes = [np.count_nonzero(np.diff(values[part])) for part in parts]
    liveliest = np.argsort(-np.asarray(changes), kind="stable")[: FILLING.windows]
    return (parts[k] for k in liveliest if changes[k] >= FILLING.least_knots)


def _find_in_window(time: FloatArray, values: FloatArray) -> KnotFit | Filling | None:
    """Find the knots within an evenly sampled stretch.

    Knots of half the period reproduce the record as well, so that of several rasters the longest
    is taken.
    """
    if _is_cycle(values):
        return None
    step = float(time[-1] - time[0]) / (time.size - 1)
    passed: list[KnotFit] = []
    for period in _list_periods(values):
        samples = int(max(FILLING.fitted, FILLING.least_knots * period))
        first = max((time.size - samples) // 2, 0)
        part = slice(first, first + samples)
        for fit_knots in (fit_on_grid, fit_off_grid):
            fits = [fit_knots(time[part], values[part], period * step, one) for one in Interpolant]
            good = [one for one in fits if one is not None and _is_reproduced(one, values)]
            if good:
                break
        passed += good
        if any(one.contrast < FILLING.plain for one in passed):
            break
    if not passed:
        return find_uneven_knots(time, values)
    best = min(passed, key=lambda one: one.misfit)
    enough = max(FILLING.as_good * best.misfit, FILLING.nothing * best.misfit_between)
    return max((one for one in passed if one.misfit <= enough), key=lambda one: one.period)


def _is_cycle(values: FloatArray) -> bool:
    """Return True if the record goes round a few values, as parameter numbers that a bus sends.

    Samples that were interpolated lie between two knots, so they are nearer to their neighbours
    than to samples of other knots. In a cycle they are nearer to those of the round before. If
    knots reproduce one round they reproduce all, which is no further evidence; and a short round
    has fewer numbers than knots have unknowns. Five are reproduced by two cubic knots with two
    unknowns each and their start.
    """
    most = values.size // FILLING.rounds
    apart = [float(np.mean(np.abs(values[lag:] - values[:-lag]))) for lag in range(1, most + 1)]
    beside = apart[0]
    return min(apart) < beside > FILLING.cyclic * max(apart)


def _list_periods(values: FloatArray) -> list[float]:
    """List possible periods [samples] of the knots, longest first.

    A linear filling shows in second differences, a cubic one in fourth; over several samples, as
    rounding hides the bend from one to the next.
    """
    peaks: list[tuple[float, float]] = []
    nothing = _NO_BEND * ROUND_OFF * float(np.abs(values).max(initial=0.0))
    for order in (2, 4):
        for lag in FILLING.lags:
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
    strongest = periods[: FILLING.periods]
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
    level = median_filter(power, 2 * FILLING.beside + 1, mode="mirror") / np.log(2.0)
    power = np.divide(power, level, out=np.zeros_like(power), where=level > 0.0)
    high = power > np.log(power.size / FILLING.chance)
    longest = bends.size / FILLING.least_knots
    peaks = []
    for first, end in find_true_runs(high):
        top = first + int(np.argmax(power[first:end]))
        frequency = _refine_peak(power, top) / ranks.size
        if frequency * longest > 1.0:
            peaks.append((float(power[top]), _snap_period(1.0 / frequency)))
    return peaks


def _refine_peak(power: FloatArray, top: int) -> float:
    """Return the position of a maximum of `power` between its samples, by a parabola of logs."""
    if not 0 < top < power.size - 1:
        return float(top)
    left, middle, right = np.log(power[top - 1 : top + 2])
    bend = left - 2.0 * middle + right
    return top + (0.5 * float((left - right) / bend) if bend < 0.0 else 0.0)


def _snap_period(period: float) -> float:
    """Return a whole number of samples where the period is one within what the spectrum shows."""
    return float(round(period)) if abs(period - round(period)) < 0.01 * period else period


def _is_reproduced(fit: KnotFit, values: FloatArray) -> bool:
    """Return True if the knots explain the record, and instants half a period away do not."""
    significant = FILLING.significant if fit.on_grid else FILLING.significant_between
    if not fit.contrast < significant:
        return False
    if fit.contrast < FILLING.exact:
        return True
    step = estimate_lattice(values)
    explained = fit.misfit**2 < FILLING.rounding * step**2 / 12.0
    return bool(explained and _estimate_knot_noise(fit.values) > FILLING.noise * step)


def _estimate_knot_noise(values: FloatArray) -> float:
    """Estimate the standard deviation of white noise of knots `values` (n,) by third differences.

    The least over several lags: the stairs of a rounded ramp look like noise except at the lag
    after which they repeat.
    """
    sizes = (np.median(np.abs(_difference(values, 3, lag))) for lag in _NOISE_LAGS)
    return float(1.4826 * min(sizes) / np.sqrt(20.0))


def estimate_lattice(values: FloatArray) -> float:
    """Estimate the step that all `values` (n,) are rounded to; 0 if none is seen.

    The least change of the slope of a densely sampled signal is one step.
    """
    bends = np.abs(np.diff(values, 2))
    floor = _NO_BEND * ROUND_OFF * float(np.abs(values).max(initial=0.0))
    bends = bends[bends > floor]
    if bends.size < FILLING.least_knots:
        return 0.0
    step = float(np.quantile(bends, 0.01))
    near = bends[bends < 20.0 * step] / step
    step *= float(np.median(near[near < 1.5]))
    multiples = near[near < 10.0]
    off = np.abs(multiples - np.round(multiples))
    return step if float(np.quantile(off, 0.9)) < 0.05 else 0.0


def _extend_filling(
    time: FloatArray, values: FloatArray, found: KnotFit | Filling
) -> Filling | None:
    """Return the knots of the whole record; `found` are those of a window.

    None where the rest of the record has no such knots.
    """
    if isinstance(found, Filling):
        return find_uneven_knots(time, values) or found
    step = compute_median_step(time)
    kind = FillKind.LINEAR if found.interpolant is Interpolant.LINEAR else FillKind.CUBIC
    if found.on_grid:
        count = np.round((time - found.start) / found.period)
        at = np.abs(time - found.start - count * found.period) < 0.5 * step
        return Filling(kind, found.period, step, time[at], values[at])
    knots, heights = extend_knots(time, values, found)
    return Filling(kind, found.period, step, knots, heights) if knots.size else None


def find_uneven_knots(time: FloatArray, values: FloatArray) -> Filling | None:
    """Find knots at uneven instants: messages that arrived with jitter, filled up linearly.

    Between knots lie at least three samples on a straight line; lines meet at the knots. Kind
    UNKNOWN where many lines are shorter, of a record that is not rounded.
    """
    step = compute_median_step(time)
    nothing = np.empty(0)
    unknown = Filling(FillKind.UNKNOWN, np.nan, step, nothing, nothing)
    bends, lattice = np.abs(np.diff(values, 2)), estimate_lattice(values)
    # A rounded straight line has bends of up to two steps, another one those of round-off.
    border = max(_ROUNDED_BENDS * lattice, ROUND_OFF * float(np.abs(values).max()))
    if not _has_straight_parts(values, bends, border):
        return None
    parts = find_true_runs(bends <= border)
    if not _bends_at_points(bends > border):
        # Nothing that is measured alternates between lines without noise and bends.
        return unknown if lattice == 0.0 and len(parts) > _MANY_LINES * time.size else None
    lines = [_Line.fit(time, values, a, b + 2) for a, b in parts]
    straight = [one.measure_deviation(time, values) < _DEVIATION * border for one in lines]
    if np.mean(straight) < FILLING.covered:
        return None
    if sum(one.end - one.first for one in lines) < FILLING.covered * time.size:
        return unknown
    instants = [float(time[lines[0].first])]
    heights = [float(values[lines[0].first])]
    usual = float(np.median([one.stop - one.start for one in lines])) + step
    for line, after in pairwise((*lines, None)):
        assert line is not None
        met = line.stop if after is None else line.meet(after)
        # A long line has knots without a bend, as at rest: samples of the record stand for them.
        many = max(round((met - instants[-1]) / usual), 1)
        for at in np.linspace(instants[-1], met, many + 1)[1:]:
            if at > instants[-1]:
                instants.append(float(at))
                heights.append(line.compute(float(at)))
    at = np.asarray(instants)
    return Filling(FillKind.LINEAR, float(np.median(np.diff(at))), step, at, np.asarray(heights))


def _has_straight_parts(values: FloatArray, bends: FloatArray, border: float) -> bool:
    """Return True if many bends are those of straight lines, and others are not.

    Samples at rest have no bend whether they were measured or not, and do not count.
    """
    changes = np.diff(values) != 0.0
    moving = bends[changes[1:] & changes[:-1]]
    straight = np.count_nonzero(moving <= border)
    return bool(FILLING.share * moving.size < straight < moving.size)


def _bends_at_points(bent: NDArray[np.bool_]) -> bool:
    """Return True if a record bends (n,) at single points: a knot lies at or between samples.

    A measured record with straight parts, as a ramp of a noise-free speed, bends all along the
    others.
    """
    lengths = np.array([end - first for first, end in find_true_runs(bent)])
    few = lengths.size < FILLING.least_knots
    return not few and float(np.mean(lengths <= _BENDS_OF_A_KNOT)) > FILLING.covered


@dataclass(frozen=True)
class _Line:
    """Straight part of a record: samples `first` to `end`, from `start` to `stop` [s]."""

    first: int
    end: int
    start: float
    stop: float
    level: float
    slope: float

    @classmethod
    def fit(cls, time: FloatArray, values: FloatArray, first: int, end: int) -> _Line:
        """Fit the line by least squares."""
        x, y = time[first:end] - time[first], values[first:end]
        slope, level = np.polyfit(x, y, 1)
        ends = float(time[first]), float(time[end - 1])
        return cls(first, end, *ends, float(level), float(slope))

    def measure_deviation(self, time: FloatArray, values: FloatArray) -> float:
        """Return the largest distance of the samples from the line."""
        part = slice(self.first, self.end)
        line = self.level + self.slope * (time[part] - self.start)
        return float(np.abs(values[part] - line).max())

    def compute(self, time: float) -> float:
        """Compute the height of the line at `time` [s]."""
        return self.level + self.slope * (time - self.start)

    def meet(self, after: _Line) -> float:
        """Return the instant [s] between the lines at which they meet."""
        turn = self.slope - after.slope
        apart = after.compute(self.start) - self.level
        at = self.start + apart / turn if turn else 0.5 * (self.stop + after.start)
        return float(np.clip(at, min(self.stop, after.start), max(self.stop, after.start)))
