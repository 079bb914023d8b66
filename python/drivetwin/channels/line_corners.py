# SPDX-License-Identifier: MIT
"""Fillings by straight lines: the knots are the rows at which a record leaves its lines.

A row between knots lies on the line through its neighbours within the resolution of the numbers.
The instants of the other rows obey a raster with jitter, some of whose samples have no bend that
shows. The evidence is the logarithm of the ratio of the probabilities of their distances, to those
of a measured record: its rows lie on lines by chance, or it was computed of straight stretches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import (
    FloatArray,
    estimate_rounding_step,
    find_largest,
    find_true_runs,
    remember_for_arrays,
)

PRIOR = float(np.log(1e4))
"""Logarithm of the prior odds against a filled channel: one in ten thousand measured ones may be
mistaken."""
_WHOLE = 0.01
"""Deviation from a multiple that is round-off [steps]: all numbers lie so near by no chance."""
ROUND_OFF = 8.0 * float(np.finfo(float).eps)
"""Round-off of an interpolated number over the largest one."""
_MIN_DISTANCES = 4
"""Fewest distances that show a raster: more than its period, jitter and share of strays [count]."""
_QUANTILES = (0.05, 0.1, 0.25, 0.5)
"""Distances that a search for the period begins with, as shares of all: some rows are hidden."""
_PAUSE = 5.0
"""Time between rows that is a pause of the record, as for gaps of a channel [periods]."""
_ROUNDS = 20
"""Steps of such a search [count]: cost of work."""
_MOST_DIGITS = 12
"""Most significant digits of a text [count]: of more, round-off hides the multiples."""
_SCREENED = 2000
"""Values or distances that are looked at before all others [count]: cost of work. A filling shows
in any of them."""
_LEAST_FILLED, _MOST_FILLED = 0.01, 0.9
"""Least ratio of interpolated rows to samples, and largest share of them where no sample is found:
priors."""


@dataclass(frozen=True, eq=False)
class LineKnots:
    """Knots of straight lines: instants `time` [s] (m,), `values` (m,), and usual `period` [s]."""

    time: FloatArray
    values: FloatArray
    period: float


@remember_for_arrays
def estimate_resolution(values: FloatArray) -> float:
    """Estimate the step that all `values` (n,) are rounded to.

    That of a lattice, else of the last decimal of a text, else of the largest number of a text with
    so many significant digits, else the round-off of the numbers.
    """
    largest = find_largest(values)
    round_off = ROUND_OFF * largest
    with np.errstate(over="ignore"):
        is_single = np.array_equal(values, values.astype(np.float32))
    if is_single:
        round_off = float(np.spacing(np.float32(largest)))
    numbers = np.unique(values)
    few = numbers[:: max(numbers.size // _SCREENED, 1)]
    found = round_off
    for step in 10.0 ** -np.arange(0.0, 16.0):
        if step < round_off:
            break
        if _are_multiples(few, step) and _are_multiples(numbers, step):
            found = float(step)
            break
    for digits in range(1, _MOST_DIGITS + 1):
        if _have_digits(few, digits) and _have_digits(numbers, digits):
            found = _choose_step(numbers, found, 10.0 ** (np.floor(np.log10(largest)) + 1 - digits))
            break
    return max(found, estimate_rounding_step(values))


def _choose_step(numbers: FloatArray, even: float, coarse: float) -> float:
    """Choose the step of the largest of different `numbers` (m,): the `even` one of all, or the
    `coarse` one of a text with so many significant digits, whose smaller numbers have finer steps.

    A number that is rounded to even steps fits the coarse one by a chance of their ratio.
    """
    decade = 10.0 ** np.floor(np.log10(np.abs(numbers).max()))
    seen = int(np.count_nonzero(np.abs(numbers) >= decade))
    return coarse if seen * np.log(max(coarse / even, 1.0)) > PRIOR else even


def _have_digits(values: FloatArray, digits: int) -> bool:
    """Return True if all numbers (n,) have at most so many significant digits."""
    size = np.abs(values[values != 0.0])
    steps = 10.0 ** (np.floor(np.log10(size)) + 1.0 - digits)
    known = bool(np.all((steps > 0.0) & np.isfinite(steps)))  # not below the smallest number
    return size.size > 0 and known and _are_multiples(size, steps)


def _are_multiples(values: FloatArray, step: float | FloatArray) -> bool:
    with np.errstate(over="ignore", invalid="ignore"):  # steps far below the numbers: no multiples
        scaled = values / step
        return bool(np.all(np.abs(scaled - np.round(scaled)) <= _WHOLE))


@dataclass(frozen=True, eq=False)
class _Corners:
    """Rows (m,) at which a record leaves its straight lines, and their raster.

    `period` [s] is the mean of the distances that obey a raster, `likelihood` its logarithm and
    `evidence` that of a filling against measured rows.
    """

    rows: NDArray[np.intp]
    period: float
    likelihood: float
    evidence: float


@dataclass(frozen=True, eq=False)
class _Bends:
    """Inner rows (n-2,) against the line through their neighbours.

    `bends` are their distances from it, `slopes` [1/s] the slopes of the line, `rest` the rows that
    repeat both neighbours, and `step` the largest distance that the resolution of numbers makes,
    which are `rounded` where that is more than round-off.
    """

    bends: FloatArray
    slopes: FloatArray
    rest: NDArray[np.bool_]
    step: float
    rounded: bool


@remember_for_arrays
def _measure_bends(time: FloatArray, values: FloatArray) -> _Bends:
    span = time[2:] - time[:-2]
    share = (time[1:-1] - time[:-2]) / span
    bends = values[1:-1] - (1.0 - share) * values[:-2] - share * values[2:]
    slopes = np.abs(values[2:] - values[:-2]) / span
    rest = (values[1:-1] == values[:-2]) & (values[2:] == values[1:-1])
    step = estimate_resolution(values)
    round_off = ROUND_OFF * find_largest(values)
    return _Bends(bends, slopes, rest, step + round_off, step > 2.0 * round_off)


def find_corners(time: FloatArray, values: FloatArray) -> LineKnots | None:
    """Find knots of straight lines at any rows, or one between two rows.

    Stamps are exact, or rounded like numbers of a text: the likelier of both.

    Parameters
    ----------
    time, values : FloatArray, shape (n,)
        Record [s].

    Returns
    -------
    LineKnots or None
        None where the record is as likely to be measured at each row.
    """
    seen = _measure_bends(time, values)
    rest = np.pad(seen.rest, 1, constant_values=True)
    best = None
    for blur in list_blurs(time):
        bent = np.zeros(values.size, dtype=bool)
        bent[1:-1] = np.abs(seen.bends) > seen.step + blur * seen.slopes
        pairs = bent.copy()
        pairs[1:-1] &= ~bent[:-2] | bent[2:] | np.concatenate(([False], bent[:-3]))
        for marked in (bent, pairs):
            found = _weigh_corners(time, np.flatnonzero(marked), rest, seen)
            if found is None:
                continue
            doubled = np.count_nonzero(bent) / found.rows.size - 1.0
            likely = found.likelihood - found.rows.size * _compute_entropy(doubled)
            if best is None or likely > best[3]:
                best = found, bent, marked is pairs, likely
    if best is None or best[0].evidence < PRIOR:
        return None
    return _join_lines(time, values, best[0], best[1] if best[2] else None)


def has_short_lines(time: FloatArray, values: FloatArray) -> bool:
    """Return True if rows lie between samples whose places are not seen.

    Rows of a record (n,) without rounding are on the line through their neighbours by chance, or it
    was computed of straight stretches, whose lengths have no scale; those between samples are
    short.
    """
    seen = _measure_bends(time, values)
    if seen.rounded:
        return False
    straight = np.abs(seen.bends) <= seen.step
    runs = [(a, b) for a, b in find_true_runs(straight) if not seen.rest[a:b].any()]
    lengths = np.array([end - first for first, end in runs], dtype=float)
    if lengths.size < _MIN_DISTANCES:
        return False
    by_chance = _weigh_straight(lengths.size, _expect_straight(seen, np.flatnonzero(~straight) + 1))
    stay = min(1.0 - lengths.size / float(np.sum(lengths)), _MOST_FILLED)
    short = (lengths - 1.0) * np.log(max(stay, 1.0 / time.size)) + np.log(1.0 - stay)
    evidence = min(by_chance, float(np.sum(short + np.log(lengths * np.log(time.size)))))
    return evidence > PRIOR


def _expect_straight(seen: _Bends, rows: NDArray[np.intp]) -> float:
    """Return how many bent `rows` (m,) of a measured record have a straight one next by chance.

    The ratio of two normal numbers is below a small one with 2/pi times that as probability.
    """
    bends = np.maximum(np.abs(seen.bends[rows - 1]), seen.step)
    return max(2.0 / np.pi * float(np.sum(seen.step / bends)), 1.0)


def _weigh_straight(count: float, expected: float) -> float:
    """Return the evidence of so many straight stretches against the number `expected` by chance."""
    more = count / expected
    return count * float(np.log(more) - 1.0 + 1.0 / more) if more > 1.0 else 0.0


def _weigh_signs(bends: FloatArray, largest: float) -> float:
    """Return the evidence of the signs of `bends` (m,) for knots with noise.

    Those of a smooth curve, which rounding hides or shows, are at most the `largest`. They keep
    their sign as often as they would change it at three of four knots with noise.
    """
    small = bends[np.abs(bends) <= largest]
    changes = int(np.count_nonzero(small[1:] * small[:-1] < 0.0))
    return float(np.log(3.0)) * (2 * changes - max(small.size - 1, 0))


@remember_for_arrays
def list_blurs(time: FloatArray) -> tuple[float, ...]:
    """Return the steps [s] to which stamps may be rounded; even ones are exact."""
    unevenness = float(np.ptp(np.diff(time)))
    # No resolution is finer than round-off.
    if unevenness <= 2.0 * ROUND_OFF * float(np.abs(time).max()):
        return (0.0,)
    blur = estimate_resolution(time)
    return (0.0,) if unevenness <= 2.0 * blur else (0.0, blur)


def _weigh_corners(
    time: FloatArray, rows: NDArray[np.intp], rest: NDArray[np.bool_], seen: _Bends
) -> _Corners | None:
    """Compute the evidence that bent `rows` (m,) are samples of a raster with jitter.

    Distances across rows at `rest` (n,), which have no bend in either case, do not count. None
    where each row is bent.
    """
    resting = np.cumsum(rest)
    first, last = rows[:-1], rows[1:]
    moving = resting[last - 1] == resting[first]
    first, last = first[moving], last[moving]
    count = last - first
    if count.size < _MIN_DISTANCES or count.max() == 1:
        return None
    # A raster has two unknowns more than a Markov chain.
    against = _measure_chance(count, time.size, seen.rounded) + float(np.log(count.size))
    if seen.rounded:
        against -= min(_weigh_signs(seen.bends[rows - 1], 2.0 * seen.step), 0.0)
    if against + PRIOR > 0.0:  # more than a raster that fits exactly can have
        return None
    # If each row is a sample of the raster the record is not filled. Pauses do not count.
    steps = np.diff(time)

    def is_filled(fit: tuple[float, float]) -> bool:
        recorded = float(np.sum(np.minimum(steps, _PAUSE * fit[1])))
        return fit[1] * steps.size > (1.0 + _LEAST_FILLED) * recorded

    some = slice(None, None, max(count.size // _SCREENED, 1))
    few = _Distances.build(time, first[some], last[some])
    starts = np.unique(np.quantile(few.apart, _QUANTILES, method="lower"))
    rough = [fit for one in starts if is_filled(fit := _fit_raster(few, float(one)))]
    best = max(rough, default=(-np.inf, 0.0))
    if best[0] < _measure_chance(count[some], time.size, seen.rounded):
        return None
    every = few
    if few.apart.size < count.size:
        every = _Distances.build(time, first, last)
        best = _fit_raster(every, best[1])
    likelihood, period = best
    periods = np.maximum(np.round(every.apart / period), 1.0)
    usual = float(np.median(every.apart / periods))
    return _Corners(rows, usual, likelihood, likelihood - against)


@dataclass(frozen=True, eq=False)
class _Distances:
    """Distances (m,) of bent rows: `apart` [s].

    `least` and `largest` [s] are those for which the samples would be at the same rows, `scaleless`
    the probability of each distance that obeys no raster.
    """

    apart: FloatArray
    least: FloatArray
    largest: FloatArray
    scaleless: FloatArray

    @classmethod
    def build(cls, time: FloatArray, first: NDArray[np.intp], last: NDArray[np.intp]) -> _Distances:
        """Build the distances from `first` (m,) to `last` (m,) of the rows at `time` (n,) [s]."""
        after = time[np.minimum(last + 1, time.size - 1)]
        least, largest = 0.5 * (time[last] + time[last - 1]), 0.5 * (time[last] + after)
        begin = time[first]
        scaleless = _weigh_scaleless(last - first, time.size)
        return cls(time[last] - begin, least - begin, largest - begin, scaleless)


def _weigh_scaleless(count: NDArray[np.intp], rows: int) -> FloatArray:
    """Return the probabilities (m,) of distances without a scale: each octave is as likely."""
    return np.asarray(1.0 / (count * np.log(rows)))


def _fit_raster(distances: _Distances, period: float) -> tuple[float, float]:
    """Fit a raster to distances of samples, some of which are not seen.

    Begins with a `period` [s]; returns the log-likelihood and the period.
    """
    apart = distances.apart
    cells = distances.least, distances.largest
    hidden = stray = 0.1
    jitter = 0.2 * period
    best = (-np.inf, period)
    for _ in range(_ROUNDS):
        periods = np.maximum(np.round(apart / period), 1.0)
        jitter = max(jitter, 1e-3 * period)
        low, high = (_compute_normal_share((one - periods * period) / jitter) for one in cells)
        often = (1.0 - hidden) * hidden ** (periods - 1.0) * (high - low)
        likely = stray * distances.scaleless + (1.0 - stray) * often
        total = float(np.sum(np.log(likely)))
        if total < best[0] + 0.01:
            break
        best = (total, period)
        weight = (1.0 - stray) * often / likely + 1e-9
        stray = max(1.0 - float(np.mean(weight)), 1e-6)
        period = float(np.sum(weight * periods * apart) / np.sum(weight * periods**2))
        jitter = float(np.sqrt(np.average((apart - periods * period) ** 2, weights=weight)))
        hidden = max(1.0 - 1.0 / float(np.average(periods, weights=weight)), 1e-3)
    return best


def _compute_normal_share(deviation: FloatArray) -> FloatArray:
    """Return the share of a normal distribution below `deviation` (n,)."""
    from scipy.special import ndtr

    return np.asarray(ndtr(deviation))


def _measure_chance(count: NDArray[np.intp], rows: int, rounded: bool) -> float:
    """Return the greatest log-likelihood of distances (m,) of bent rows in a measured record.

    After a bent row comes another one, or a straight stretch whose length is that of a Markov chain
    (noise that rounding hides), or without a scale (a computed signal).
    """
    longer = count > 1
    begun = float(np.count_nonzero(longer))
    more = float(np.sum(count[longer] - 2.0))
    often = begun / count.size
    stay = more / max(more + begun, 1.0)
    if not rounded:
        # Noise that put a row on the line by chance puts the next one there no less likely.
        stay = min(max(stay, often), 1.0 - 1.0 / count.size)
    with np.errstate(divide="ignore", invalid="ignore"):
        chain = np.nansum([more * np.log(stay), begun * np.log(1.0 - stay)])
    entropy = -count.size * _compute_entropy(often)
    return entropy + max(float(chain), float(np.sum(np.log(_weigh_scaleless(count[longer], rows)))))


def _compute_entropy(share: float) -> float:
    """Return the entropy [nats] of an event of the probability `share`."""
    both = np.array([share, 1.0 - share])
    return -float(np.sum(both[both > 0.0] * np.log(both[both > 0.0])))


def _join_lines(
    time: FloatArray, values: FloatArray, found: _Corners, pairs: NDArray[np.bool_] | None
) -> LineKnots:
    """Return the knots: bent rows, or where lines meet between the rows of bent `pairs` (n,).

    A straight stretch, as at rest, has knots without a bend: rows at the usual distance stand for
    them.
    """
    at, heights = time[found.rows], values[found.rows]
    if pairs is not None:
        at, heights = _meet_lines(time, values, found, pairs)
    ends = np.concatenate((time[:1], at, time[-1:]))
    parts = np.round(np.diff(ends) / found.period).astype(int)
    wide = [*np.flatnonzero(parts > 1), *np.flatnonzero(parts[[0, -1]] == 1) * (parts.size - 1)]
    hidden = [np.linspace(ends[k], ends[k + 1], parts[k] + 1) for k in wide]
    middle = 0.5 * (time[1:] + time[:-1])
    nearest = np.searchsorted(middle, np.concatenate([*hidden, at[:0]]))
    rows = np.setdiff1d(nearest, found.rows)
    at, order = np.unique(np.concatenate((at, time[rows])), return_index=True)
    heights = np.concatenate((heights, values[rows]))[order]
    return LineKnots(at, heights, found.period)


def _meet_lines(
    time: FloatArray, values: FloatArray, found: _Corners, bent: NDArray[np.bool_]
) -> tuple[FloatArray, FloatArray]:
    """Return instants [s] and heights of knots at single bent rows (m,) and between pairs.

    No knot lies in a pause of the record.
    """
    rows = found.rows
    at, heights = time[rows], values[rows]
    pair = np.flatnonzero(bent[np.minimum(rows + 1, time.size - 1)])
    left = np.concatenate(([0], rows))[pair]
    right = np.concatenate((rows, [time.size - 1]))[pair + 1]
    low, high = rows[pair], rows[pair] + 1
    pause = time[np.minimum(high, time.size - 1)] - time[low]
    fits = (left < low) & (right > high) & (pause < _PAUSE * found.period)
    pair, left, right, low, high = (one[fits] for one in (pair, left, right, low, high))
    left = np.minimum(left + bent[np.minimum(left + 1, time.size - 1)], low - 1)
    rise = (values[low] - values[left]) / (time[low] - time[left])
    after = (values[right] - values[high]) / (time[right] - time[high])
    turn = rise - after
    apart = values[high] - values[low] - after * (time[high] - time[low])
    late = np.divide(apart, turn, out=0.5 * (time[high] - time[low]), where=turn != 0.0)
    late = np.clip(late, 0.0, time[high] - time[low])
    at[pair] += late
    heights[pair] += rise * late
    return at, heights
