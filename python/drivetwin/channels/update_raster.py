# SPDX-License-Identifier: MIT
"""Update raster of slow signals that a logger repeats on a faster time base.

An example is a CAN torque in a 1 kHz table.

Only the instants of update carry information: a value is fresh there and stale until the next.
An update may repeat the old value because of rounding, so not every update is a change of value.
The updates lie on a regular raster, and the changes are a subset of its points. A logger whose
step does not divide the period, e.g. 2 ms for 5 ms, records each update up to one step late; the
time of the update is then taken from the raster.

The changes of a held signal lie on a raster of updates, start + k·period. An update shows in the
first row after it; messages jitter, and a few come at any time. Or each value is repeated in so
many rows with stamps of their own, some of which are lost. Against both stand the changes of a
signal that each row has measured:

- a row changes by chance, no less likely after a change than after none (a Markov chain), or
- the record is a curve rounded to stairs, whose distances follow the slope: each is near the one
  before. Such changes have the size of the resolution and the direction of the one before.

As rare as a mistake may be is a sender of changes that only waits from one to the next.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import (
    FloatArray,
    compute_median_step,
    is_time_axis,
    remember_for_arrays,
)
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


_UNEVEN = 0.02
"""Part of a step that a period may have over a number of whole ones and count as divided by it: the
clocks of sender and logger differ by less."""

_IN_TIME = 0.05
"""Share of updates that are taken to be shown as they come; the earliest of all may be jitter."""

_PAUSE = 1.5
"""After more than so many steps without a sample the arrival of a value is unknown: a sample is
missing."""


@dataclass(frozen=True)
class UpdateRaster:
    """Instants `start` + k·`period` [s] at which a logger shows the updates.

    Where the logger's step does not divide the period they come `early` [s] before that. Changes
    lie about it by `spread` [s], root of the mean square.
    """

    start: float
    period: float
    early: float = 0.0
    spread: float = 0.0


def find_raster(time: FloatArray, values: FloatArray) -> UpdateRaster | None:
    """Return the update raster of a held channel; None where each sample may be an update.

    The raster is the likeliest one; start and period are fitted by least squares so that clock
    drift does not add up. Where the clock of the sender wanders it has the period alone.
    """
    if not is_time_axis(time):
        return None
    found = find_change_raster(time, values)
    if found is None or not _shows_updates(time, values):
        return None
    if found.loose:
        return UpdateRaster(float(time[0]), found.period)
    return _make_raster(found, _find_clock(time))


def _shows_updates(time: FloatArray, values: FloatArray) -> bool:
    """Return True if most changes follow at once on a sample.

    A change after a pause came at any time within it: pauses at even distances are no raster.
    """
    changes = np.count_nonzero(values[1:] != values[:-1])
    return bool(2 * np.count_nonzero(_find_changes(time, values)) >= changes)


def _find_changes(time: FloatArray, values: FloatArray) -> NDArray[np.bool_]:
    """Mark samples with a new value (n-1,), without the first one and those after a pause."""
    return np.asarray((values[1:] != values[:-1]) & _follow_at_once(time))


@remember_for_arrays
def _follow_at_once(time: FloatArray) -> NDArray[np.bool_]:
    """Mark samples (n-1,), without the first one, that do not come after a pause."""
    return np.asarray(np.diff(time) <= _PAUSE * compute_median_step(time))


@remember_for_arrays
def _find_clock(time: FloatArray) -> float | None:
    """Return the step [s] of a logger that samples by a clock; None for stamps of messages."""
    rows = np.diff(time) / compute_median_step(time)
    whole = np.round(rows)
    rows -= whole
    if max(rows.max(), -rows.min()) > _UNEVEN:
        return None
    return float((time[-1] - time[0]) / np.sum(whole))


def _make_raster(found: ChangeRaster, step: float | None) -> UpdateRaster:
    """Build the raster of the rows that show updates."""
    middle = float(np.mean(found.late))
    late = found.late - middle
    lead = 0.0 if step is None else _estimate_lead(found.period, step, late)
    return UpdateRaster(found.start + middle, found.period, lead, float(np.std(late)))


def _estimate_lead(period: float, step: float, late: FloatArray) -> float:
    """Estimate by how much updates precede the raster [s]; changes show `late` (n,) after it.

    Where the step does not divide the period, some come just in time for a sample. Otherwise all
    have the same unknown delay and count as in time.
    """
    return -float(np.quantile(late, _IN_TIME)) if _is_off_grid(period, step) else 0.0


def _is_off_grid(period: float, step: float) -> bool:
    """Return True if the step does not divide the period."""
    steps = period / step
    return abs(steps - round(steps)) > _UNEVEN


def _match_updates(
    time: FloatArray, values: FloatArray, raster: UpdateRaster
) -> tuple[NDArray[np.intp], FloatArray]:
    """Find the samples that show an update first, and the number of its raster instant.

    That is the change near an instant, else the sample at it. An instant without a sample has no
    update.
    """
    step = compute_median_step(time)
    margin = 0.5 * step
    first = np.ceil((time[0] - margin - raster.start) / raster.period)
    last = np.floor((time[-1] + margin - raster.start) / raster.period)
    own = np.round((time - raster.start) / raster.period)
    # Of a long pause no instant needs to be looked at.
    each = own[np.append(True, np.diff(own) > 0.0)]
    count = np.unique(np.concatenate((each - 1.0, each, each + 1.0)))
    count = count[(count >= first) & (count <= last)]
    instants = raster.start + raster.period * count
    nearest = np.minimum(np.searchsorted(time, instants - margin), time.size - 1)
    there = np.abs(time[nearest] - instants) <= _PAUSE * step
    changed = np.flatnonzero(_find_changes(time, values)) + 1
    changed = changed[(own[changed] >= first) & (own[changed] <= last)]
    slot = np.searchsorted(count, own[changed])
    nearest[slot] = changed
    there[slot] = True
    samples, which = np.unique(nearest[there], return_index=True)
    return samples, count[there][which]


@remember_for_arrays
def find_updates(
    time: FloatArray, values: FloatArray
) -> tuple[FloatArray, NDArray[np.intp]] | None:
    """Return the instants [s] (m,) at which a held value was updated, and the samples (m,) that
    show it first; None if each sample may be an update.

    The value at such an instant is the newest the sender had; nothing is interpolated. Where the
    updates fall between the logger's samples, the instants are those of the raster.
    """
    raster = find_raster(time, values)
    if raster is None:
        return None
    found = find_change_raster(time, values)
    if found is not None and not found.loose and np.all(np.diff(found.count) > 0.0):
        fresh, count = _match_updates(time, values, raster)
        if raster.early > 0.0:
            return raster.start - raster.early + raster.period * count, fresh
        return time[fresh], fresh
    fresh = count_updates(time, values, raster.period)
    return time[fresh], fresh


def count_updates(time: FloatArray, values: FloatArray, period: float) -> NDArray[np.intp]:
    """Find the updated samples: the changes, and between them one for each period."""
    step = compute_median_step(time)
    changed = np.concatenate(([0], np.flatnonzero(np.diff(values) != 0.0) + 1))
    last = time.size - 1
    ends = time[np.append(changed, last)]
    most = np.maximum(np.diff(np.append(changed, last)), 1)
    count = np.clip(np.round(np.diff(ends) / period), 1, most).astype(int)
    steps = np.diff(ends) / count
    place = np.arange(1, count.sum() - count.size + 1) - np.repeat(
        np.cumsum(count - 1) - (count - 1), count - 1
    )
    instants = place * np.repeat(steps, count - 1) + np.repeat(ends[:-1], count - 1)
    nearest = np.searchsorted(time, instants - 0.5 * step)
    there = np.abs(time[nearest] - instants) <= _PAUSE * step
    return np.unique(np.concatenate((changed, nearest[there])))
