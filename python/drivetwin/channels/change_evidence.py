# SPDX-License-Identifier: MIT
"""Evidence that the rows at which a record changes are the updates of a held signal.

The changes of a held signal lie on a raster of updates, start + k·period, some of which repeat the
value before. An update shows in the first row after it; messages jitter, and a few come at any
time. Or each value is repeated in so many rows with stamps of their own, some of which are lost.
Against both stand the changes of a signal that each row has measured:

- a row changes by chance, no less likely after a change than after none (a Markov chain), or
- the record is a curve rounded to stairs, whose distances follow the slope: each is near the one
  before. Such changes have the size of the resolution and the direction of the one before.

As rare as a mistake may be is a sender of changes that only waits from one to the next.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray, remember_for_arrays
from drivetwin.channels.line_corners import PRIOR, estimate_resolution

_ROUNDS = 8
"""Steps of a search for the parameters of a model [count]: cost of work."""
_TRACKED = 9
"""Changes whose mean phase is that of the raster [count]: their number divides its variance."""
_TRIED = 32
"""Distances that are tried as a period [count]: cost of work."""
_SCREENED = 1000
"""Changes by which periods are compared at first [count]: cost of work."""
_KEPT = 4
"""Periods that are compared by all changes [count]: cost of work."""
_COUNTABLE = 1.0 / 6.0
"""Largest jitter of updates over their period: of more, half a period is within three standard
deviations, so that the updates between two changes could not be counted."""
_PRICE_OF_INSTANTS, _PRICE_OF_REPEATS = 2.5, 0.5
"""Logarithm of the number of changes by which the likelihood of a raster falls for its unknowns
(Schwarz 1978): a half each beyond the two of a measured signal, a half of three for the period."""
_EXACT = 1e-3
"""Jitter over the distance of rows that counts as none."""
_LEAST_SHARE = 1e-4
"""Least share of changes that a model expects of any sort: a log has no more to exclude them."""


@dataclass(frozen=True, eq=False)
class Changes:
    """Changes of a record: instants `time` [s] (m,) and `rows` (m,) that show them.

    `width` [s] (m,) is the time from the row before, `stair` (m,) marks those that may be stairs.
    """

    time: FloatArray
    width: FloatArray
    rows: NDArray[np.intp]
    stair: NDArray[np.bool_]

    def select_middle(self, count: int) -> Changes:
        """Return at most so many changes in the middle of the record."""
        first = max((self.rows.size - count) // 2, 0)
        some = slice(first, first + count)
        return Changes(self.time[some], self.width[some], self.rows[some], self.stair[some])


def find_changes(time: FloatArray, values: FloatArray) -> Changes:
    """Collect the changes of a record (n,)."""
    rows = np.flatnonzero(values[1:] != values[:-1]) + 1
    sizes = values[rows] - values[rows - 1]
    least = np.abs(sizes) < 1.5 * estimate_resolution(values)
    stair = np.zeros(rows.size, dtype=bool)
    stair[1:] = least[1:] & least[:-1] & (np.sign(sizes[1:]) * np.sign(sizes[:-1]) > 0.0)
    return Changes(time[rows], time[rows] - time[rows - 1], rows, stair)


@dataclass(frozen=True, eq=False)
class ChangeRaster:
    """Raster of the updates `start` + k·`period` [s] that changes show.

    `late` [s] (m,) is how much later each is shown, `count` (m,) the number of its update, and
    `likelihood` its logarithm. A `loose` raster has no start: values are repeated in so many rows.
    """

    start: float
    period: float
    late: FloatArray
    count: FloatArray
    likelihood: float
    loose: bool


@remember_for_arrays
def find_change_raster(time: FloatArray, values: FloatArray) -> ChangeRaster | None:
    """Find the raster on which the changes of a record lie.

    Parameters
    ----------
    time, values : FloatArray, shape (n,)
        Record [s].

    Returns
    -------
    ChangeRaster or None
        None where a signal that each row has measured is as likely.
    """
    changed = values[1:] != values[:-1]
    if 2 * np.count_nonzero(changed[1:] & changed[:-1]) >= np.count_nonzero(changed):
        return None  # Most changes follow in the next row: none of two rows or more is a period.
    changes = find_changes(time, values)
    repeats = _list_repeats(changes)
    if not repeats:
        return None
    against = _weigh_alternatives(changes)
    if against + PRIOR > 0.0:  # more than a raster that fits exactly can have
        return None
    few = changes.select_middle(_SCREENED)
    rough = [(fit.likelihood, one) for one in repeats if (fit := _fit_best(few, one))]
    least = _weigh_alternatives(few)
    likely = [one for likelihood, one in sorted(rough, reverse=True)[:_KEPT] if likelihood > least]
    fits = [fit for one in likely if (fit := _fit_best(changes, one))]
    if not fits:
        return None
    found = max(fits, key=lambda one: one.likelihood)
    unknowns = _PRICE_OF_REPEATS if found.loose else _PRICE_OF_INSTANTS
    price = unknowns * np.log(changes.rows.size) + np.log(len(repeats))
    return found if found.likelihood - against - price > PRIOR else None


def _weigh_alternatives(changes: Changes) -> float:
    """Return the log-likelihood of changes that lie on no raster."""
    return max(weigh_measured(changes), _weigh_irregular(np.diff(changes.rows)) - PRIOR)


def _list_repeats(changes: Changes) -> list[int]:
    """List distances of changes that may be the rows of a period, the most frequent ones.

    Updates are no rarer than changes.
    """
    rows = np.diff(changes.rows)
    if rows.size < 2:
        return []
    apart, often = np.unique(rows, return_counts=True)
    frequent = apart[np.argsort(-often, kind="stable")][:_TRIED]
    return [int(one) for one in frequent if 1 < one <= 2.0 * np.mean(rows)]


def _fit_best(changes: Changes, repeats: int) -> ChangeRaster | None:
    """Return the likelier raster of about so many rows; None where the changes show none.

    Senders have a clock; that one has none needs as much evidence as a raster itself.
    """
    usual = np.diff(changes.time)[np.diff(changes.rows) == repeats]
    if not usual.size:
        return None
    step = float(np.median(usual)) / repeats
    tight, loose = _fit_instants(changes, repeats, step), _fit_repeats(changes, repeats, step)
    return loose if tight is None or loose.likelihood - tight.likelihood > PRIOR else tight


def _fit_instants(changes: Changes, repeats: int, step: float) -> ChangeRaster | None:
    """Fit a raster of about so many rows to the instants of changes; None where there is none."""
    period = repeats * step
    middle = changes.time - 0.5 * changes.width
    apart = np.diff(middle)
    for _ in range(_ROUNDS):
        steps = np.round(apart / period)
        if not np.any(steps):
            return None
        count = np.concatenate(([0.0], np.cumsum(steps)))
        _, period, _ = _fit_line(count, changes)
        if period <= 0.0:
            return None
        if np.array_equal(steps, np.round(apart / period)):
            break
    plain = _build_raster(changes, count, step)
    for _ in range(_ROUNDS):
        before, count = count, _count_updates(middle, period)
        if count[-1] < 1.0 or np.array_equal(before, count):
            break
        _, period, _ = _fit_line(count, changes)
    tracked = _build_raster(changes, count, step)
    if plain is None or tracked is None:
        return plain or tracked
    return tracked if tracked.likelihood - plain.likelihood > PRIOR else plain


def _build_raster(changes: Changes, count: FloatArray, step: float) -> ChangeRaster | None:
    """Build the raster that changes show whose updates have the numbers `count` (m,)."""
    steps, rows = np.diff(count), np.diff(changes.rows)
    if count[-1] < 1.0:
        return None
    start, period, off = _fit_line(count, changes)
    if round(period / step) < 2:  # each row may be an update
        return None
    width = changes.width[1:]
    likelihood = _weigh(off[1:] / period, width / period, steps, rows, _COUNTABLE)
    return ChangeRaster(start, period, off + 0.5 * step, count, likelihood, loose=False)


def _fit_line(count: FloatArray, changes: Changes) -> tuple[float, float, FloatArray]:
    """Fit start and period of a raster; return them with the rest of each change (m,) [s].

    A change is somewhere between its row and the one before.
    """
    middle = changes.time - 0.5 * changes.width
    weight = changes.width**-2.0 / np.sum(changes.width**-2.0)
    from_mean = count - np.sum(weight * count)
    spread = float(np.sum(weight * from_mean**2))
    period = float(np.sum(weight * from_mean * middle)) / spread if spread > 0.0 else 0.0
    start = float(np.sum(weight * (middle - period * count)))
    return start, period, middle - start - period * count


def _count_updates(middle: FloatArray, period: float) -> FloatArray:
    """Count the updates (m,) up to each change by a phase that is the mean of those about it.

    Counted from one change to the next, two that jitter apart would move all later ones.
    """
    angle = 2.0 * np.pi * (middle - middle[0]) / period
    about = np.convolve(np.exp(1j * angle), np.ones(min(_TRACKED, middle.size)), mode="same")
    count = np.round((angle - np.unwrap(np.angle(about))) / (2.0 * np.pi))
    return np.asarray(count - count[0])


def _fit_repeats(changes: Changes, repeats: int, step: float) -> ChangeRaster:
    """Fit updates each of which is repeated in so many rows, some of which may be lost."""
    rows = np.diff(changes.rows)
    apart = np.maximum(rows, np.diff(changes.time) / step)
    steps = np.round(apart / repeats)
    off = apart / repeats - steps
    width = np.full(rows.size, 1.0 / repeats)
    likelihood = _weigh(off, width, steps, rows, _COUNTABLE / repeats)
    count = np.concatenate(([0.0], np.cumsum(steps)))
    late = np.zeros(count.size)
    return ChangeRaster(float(changes.time[0]), repeats * step, late, count, likelihood, loose=True)


def _weigh(
    off: FloatArray, width: FloatArray, steps: FloatArray, rows: NDArray[np.intp], most: float
) -> float:
    """Return the log-likelihood of changes that lie `off` (m,) from their updates.

    That and the `width` (m,) of a row are in periods. `steps` and `rows` (m,) count the updates and
    rows from the change before. The jitter is `most` at most.
    """
    from scipy.special import ndtr

    scaleless = 1.0 / (rows * np.log(np.sum(rows) + 2.0))
    stray = hidden = 0.1
    least = _EXACT * float(np.median(width))
    jitter = float(np.clip(np.sqrt(np.mean(off**2)), least, most))
    total = -np.inf
    for _ in range(_ROUNDS):
        inside = ndtr((off + 0.5 * width) / jitter) - ndtr((off - 0.5 * width) / jitter)
        more = np.maximum(steps - 1.0, 0.0)
        often = np.where(steps > 0.0, (1.0 - hidden) * hidden**more * inside, 0.0)
        likely = stray * scaleless + (1.0 - stray) * often
        before, total = total, float(np.sum(np.log(likely)))
        if total - before < 0.01:
            break
        weight = (1.0 - stray) * often / likely + 1e-12
        stray = max(1.0 - float(np.mean(weight)), _LEAST_SHARE)
        jitter = float(np.clip(np.sqrt(np.average(off**2, weights=weight)), least, most))
        missed = float(np.average(more, weights=weight))
        hidden = max(missed / (1.0 + missed), _LEAST_SHARE)
    return total


def _weigh_irregular(rows: NDArray[np.intp]) -> float:
    """Return the log-likelihood of distances (m,) of a sender that waits for so many rows at least.

    What is more regular than one chance in two is a raster.
    """
    more = rows - rows.min()
    chance = min(1.0 / (1.0 + float(np.mean(more))), 0.5)
    return float(rows.size * np.log(chance) + np.sum(more) * np.log(1.0 - chance))


def weigh_measured(changes: Changes) -> float:
    """Return the greatest log-likelihood of changes of a signal that each row has measured."""
    from scipy.special import ndtr

    rows = np.diff(changes.rows).astype(float)
    after, before = rows, np.concatenate((rows[:1], rows[:-1]))
    stair = changes.stair[1:] & np.append(False, changes.stair[1:-1])
    ratio = np.log(after / before)
    share, spread = 0.5, 0.1
    at_once, chance = 0.5, float(min(rows.size / np.sum(rows), 0.5))
    total = -np.inf
    for _ in range(_ROUNDS):
        by_chance = np.where(
            rows < 2.0, at_once, (1.0 - at_once) * chance * (1.0 - chance) ** (rows - 2.0)
        )
        high, low = (np.log((after + one) / before) / spread for one in (0.5, -0.5))
        follow = np.where(stair, ndtr(high) - ndtr(low), 0.0)
        likely = np.where(stair, share * follow + (1.0 - share) * by_chance, by_chance)
        known, total = total, float(np.sum(np.log(likely)))
        if total - known < 0.01:
            break
        weight = np.where(stair, share * follow / likely, 0.0)
        if stair.any():
            share = float(np.clip(np.mean(weight[stair]), _LEAST_SHARE, 1.0 - _LEAST_SHARE))
            spread = max(float(np.sqrt(np.sum(weight * ratio**2) / np.sum(weight))), 0.01)
        rest = 1.0 - weight
        begun = float(np.sum(rest[rows >= 2.0]))
        stayed = float(np.sum((rest * (rows - 2.0))[rows >= 2.0]))
        chance = max(begun / max(begun + stayed, 1e-12), 1e-9)
        at_once = float(np.sum(rest[rows < 2.0])) / max(float(np.sum(rest)), 1e-12)
        if at_once < chance:
            # A change makes another one in the next row no less likely.
            at_once = chance = float(np.sum(rest)) / max(float(np.sum(rest * rows)), 1e-12)
        at_once = float(np.clip(at_once, _LEAST_SHARE, 1.0 - _LEAST_SHARE))
        chance = min(chance, 1.0 - _LEAST_SHARE)
    return total
