# SPDX-License-Identifier: MIT
"""Update raster of slow signals that a logger repeats on a faster time base.

An example is a CAN torque in a 1 kHz table.

Only the instants of update carry information: a value is fresh there and stale until the next.
An update may repeat the old value because of rounding, so not every update is a change of value.
The updates lie on a regular raster, and the changes are a subset of its points. A logger whose
step does not divide the period, e.g. 2 ms for 5 ms, records each update up to one step late; the
time of the update is then taken from the raster.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import (
    FloatArray,
    compute_median_step,
    is_time_axis,
    remember_for_arrays,
)

MIN_CHANGES = 10
"""Fewer changes of value cannot prove a raster."""

USUAL_PERIODS = (0.1, 0.05, 0.04, 0.025, 0.02, 0.0125, 0.01, 0.005)
"""Periods of senders [s] that are looked for where they are no multiple of the logger's step."""

MAX_PERIOD = 0.25
"""Longest update period looked for [s]; CAN messages of interest come every 5 to 100 ms."""

_JITTER = 0.2
"""Largest distance of a change from the raster, as a share of the period ..."""

_JITTER_SAMPLES = 1.5
"""... and in samples of the logger, unless chance would not put so many so near."""

_SAME_BEAT = 1.5
"""Ratio of periods within which they rival for the same changes: half a period fits as well."""

_LEAST_STEPS = 2.1
"""Steps of the logger in a period that it does not divide: in fewer the updates cannot be counted
from change to change."""

_BETWEEN_JITTER = 0.1
"""Largest distance of such an update from the raster, as a share of the period, in addition to the
uncertainty from the logger's step."""

_UNEVEN = 0.02
"""Part of a step that a period may have over a number of whole ones and count as divided by it: the
clocks of sender and logger differ by less."""

_LOST = 2.5
"""Pause in steps from which on samples are missing."""

_IN_TIME = 0.05
"""Share of updates that are taken to be shown as they come; the earliest of all may be jitter."""

_CHANCE = 1e-6
"""Probability from which on chance may have put all changes near such a raster."""

_PAUSE = 1.5
"""After more than so many steps without a sample the arrival of a value is unknown."""


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

    The period is the longest one, up to the shortest distance of two changes, on which all changes
    lie, of those near it the one to which they lie nearest; start and period are fitted by least
    squares so that clock drift does not add up. Where stamps jitter or messages are lost, it is the
    distance that most changes have.
    """
    if time.size <= MIN_CHANGES or not is_time_axis(time):
        return None
    raster = _find_stamp_raster(time, values)
    if raster is None:
        period = estimate_repeat_period(time, values)
        raster = None if period is None else UpdateRaster(float(time[0]), period)
    return raster


@remember_for_arrays
def _find_stamp_raster(time: FloatArray, values: FloatArray) -> UpdateRaster | None:
    """Find the raster by the stamps; None if there is none."""
    changes = time[1:][_find_changes(time, values)]
    if changes.size < MIN_CHANGES:
        return None
    step, shortest = _mean_step(time), float(np.diff(changes).min())
    longest = min(shortest * (1.0 + _JITTER), MAX_PERIOD)
    whole = [(samples * step, _fit_raster) for samples in range(round(longest / step), 1, -1)]
    between = [
        (period, _fit_off_grid)
        for period in USUAL_PERIODS
        if _LEAST_STEPS * step < period < shortest + step + _BETWEEN_JITTER * period
        and _is_off_grid(period, step)
    ]
    best, least = None, 0.0
    for period, fit in sorted(whole + between, key=lambda one: -one[0]):
        if period < least:
            break
        raster = fit(changes, period, step)
        if raster is not None and (best is None or raster.spread < best.spread):
            least = raster.period / _SAME_BEAT if best is None else least
            best = raster
    return best


@remember_for_arrays
def _mean_step(time: FloatArray) -> float:
    """Compute the mean sample interval [s] without pauses: jitter of stamps moves a median."""
    steps = np.diff(time)
    return float(np.mean(steps[steps < _LOST * compute_median_step(time)]))


def _find_changes(time: FloatArray, values: FloatArray) -> NDArray[np.bool_]:
    """Mark samples with a new value (n-1,), without the first one and those after a pause."""
    return np.asarray((values[1:] != values[:-1]) & _follow_at_once(time))


@remember_for_arrays
def _follow_at_once(time: FloatArray) -> NDArray[np.bool_]:
    """Mark samples (n-1,), without the first one, that do not come after a pause."""
    return np.asarray(np.diff(time) <= _PAUSE * compute_median_step(time))


def _fit_raster(changes: FloatArray, period: float, step: float) -> UpdateRaster | None:
    """Fit a raster near `period` by least squares; None if the changes do not lie on one."""
    found = _fit_line(changes, period)
    if found is None:
        return None
    start, slope, late = found
    most = float(np.abs(late).max())
    surely = most <= _JITTER_SAMPLES * step or _is_significant(_JITTER * slope, slope, changes.size)
    if most > _JITTER * slope or not surely or slope <= 1.5 * step:
        return None
    return _make_raster(start, slope, step, late)


def _fit_off_grid(changes: FloatArray, period: float, step: float) -> UpdateRaster | None:
    """Fit a raster whose period the step does not divide: changes show up to a step late."""
    found = _fit_line(changes, period)
    if found is None:
        return None
    start, slope, late = found
    most = 0.5 * step + _BETWEEN_JITTER * period
    as_usual = abs(slope - period) < 0.01 * period
    if np.abs(late).max() > most or not _is_significant(most, period, changes.size) or not as_usual:
        return None
    return _make_raster(start, slope, step, late)


def _make_raster(start: float, period: float, step: float, late: FloatArray) -> UpdateRaster:
    """Build the raster after which changes come `late` [s] (n,)."""
    spread = float(np.sqrt(np.mean(late**2)))
    return UpdateRaster(start, period, _estimate_lead(period, step, late), spread)


def _is_significant(most: float, period: float, changes: int) -> bool:
    """Return True if chance hardly puts so many changes within `most` [s] of a raster."""
    return (2.0 * most / period) ** (changes - 2) < _CHANCE


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


def _fit_line(changes: FloatArray, period: float) -> tuple[float, float, FloatArray] | None:
    """Fit start and period of the raster near `period`, and the residual of each change (n,).

    None if two changes are closer than a period.
    """
    steps = np.round(np.diff(changes) / period)
    if steps.min() < 1.0:
        return None
    count = np.concatenate(([0.0], np.cumsum(steps)))
    slope, start = np.polyfit(count, changes, 1)
    return float(start), float(slope), np.asarray(changes - start - slope * count)


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
    raster = _find_stamp_raster(time, values)
    if raster is not None:
        fresh, count = _match_updates(time, values, raster)
        if raster.early > 0.0:
            return raster.start - raster.early + raster.period * count, fresh
        return time[fresh], fresh
    period = estimate_repeat_period(time, values)
    if period is None:
        return None
    fresh = count_updates(time, values, period)
    return time[fresh], fresh


_LEAST = 30
"""Least number of changes from which a period is estimated."""


_EVEN = 0.02
"""Part of a step by which stamps may differ and still show a raster if there is one."""


_NEAR = 0.6
"""Steps within which a distance of changes is the usual one ..."""


_NEAR_PART = 0.25
"""... or, on even stamps, this part of it."""


_MOST = 0.5
"""Least share of changes at the usual distance."""


_CLOSE = 1.5
"""Steps below which two changes are nearer than a repeated value has them ..."""


_SELDOM = 0.25
"""... but for so many whose first message was lost."""


_CLOSE_PART = 0.5
"""Like `_CLOSE` as a part of the usual distance, on even stamps."""


_STAIRS = 1.5
"""Times the least of all changes above which one is no stair of a rounded signal ..."""


_NEXT = 1.5
"""Steps below which a change follows the one before; if most do, each sample may be an update."""


_LARGER = 0.2
"""... and the least share of such among changes at the usual distance: a signal that is not held
goes stair by stair where it does not change with each sample."""


@remember_for_arrays
def estimate_repeat_period(time: FloatArray, values: FloatArray) -> float | None:
    """Estimate the period [s] at which repeated values are updated.

    None where each sample may be an update. On even stamps, where changes do jitter, those of a
    rounded signal may seem to be updates: there some must be larger than a step of the rounding.
    """
    changed = np.flatnonzero(values[1:] != values[:-1]) + 1
    if changed.size < _LEAST:
        return None
    step = compute_median_step(time)
    apart = np.maximum(np.diff(changed), np.diff(time[changed]) / step)
    if 2 * np.count_nonzero(apart < _NEXT) > apart.size:
        return None
    usual = round(float(np.median(apart)))
    near, close, least = _NEAR, _CLOSE, 0.0
    if np.abs(np.diff(time) / step - 1.0).max() < _EVEN:
        near, close = max(near, _NEAR_PART * usual), max(close, _CLOSE_PART * usual)
        least = _LARGER
    at_usual = np.abs(apart - usual) < near
    often = np.mean(at_usual) > _MOST and np.mean(apart < close) < _SELDOM
    if usual <= 1 or not often:
        return None
    size = np.abs(np.diff(values))[changed - 1]
    larger = np.mean(size[1:][at_usual] > _STAIRS * size.min())
    return usual * step if larger >= least else None


def count_updates(time: FloatArray, values: FloatArray, period: float) -> NDArray[np.intp]:
    """Find the updated samples: the changes, and between them one for each period."""
    step = compute_median_step(time)
    changed = np.concatenate(([0], np.flatnonzero(np.diff(values) != 0.0) + 1))
    last = time.size - 1
    ends = time[np.append(changed, last)]
    most = np.maximum(np.diff(np.append(changed, last)), 1)
    count = np.clip(np.round(np.diff(ends) / period), 1, most).astype(int)
    between = zip(pairwise(ends), count, strict=True)
    instants = np.concatenate([np.linspace(*p, n, endpoint=False)[1:] for p, n in between])
    nearest = np.searchsorted(time, instants - 0.5 * step)
    there = np.abs(time[nearest] - instants) <= _PAUSE * step
    return np.unique(np.concatenate((changed, nearest[there])))
