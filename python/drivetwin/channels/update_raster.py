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

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import (
    FloatArray,
    compute_median_step,
    is_time_axis,
    remember_for_arrays,
)
from drivetwin.channels.change_evidence import ChangeRaster, find_change_raster

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
