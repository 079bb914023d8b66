# SPDX-License-Identifier: MIT
"""Slow signals that a logger repeats on a faster time base, as CAN torque in a 1 kHz table.

Only the instants of update carry information: a value is fresh there and stale until the next.
Rounding can make an update repeat the old value, so the updates are not the changes; they lie on a
regular raster of which the changes show a part. A logger whose step does not divide the period, as
2 ms for 5 ms, records each update up to a step late; the raster gives its instant.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drivetwin.channels.roles import AUXILIARY
from drivetwin.channels.shiftlog import Channel, FloatArray, Quantity

MIN_CHANGES = 10
"""Fewer changes of value cannot prove a raster."""

USUAL_PERIODS = (0.1, 0.05, 0.04, 0.025, 0.02, 0.0125, 0.01, 0.005)
"""Periods of senders [s] that are looked for where they are no multiple of the logger's step."""

MAX_PERIOD = 0.25
"""Longest update period looked for [s]; CAN messages of interest come every 5 to 100 ms."""

_JITTER = 0.2
"""How far a change may lie from the raster, as part of the period ..."""

_JITTER_SAMPLES = 1.5
"""... and in samples of the logger, unless chance would not put so many so near."""

_SAME_BEAT = 1.5
"""Ratio of periods within which they rival for the same changes: half a period fits as well."""

_LEAST_STEPS = 2.1
"""Steps of the logger in a period that it does not divide: in fewer the updates cannot be counted
from change to change."""

_BETWEEN_JITTER = 0.1
"""How far such an update may lie from the raster, as part of the period, beside what the logger's
step hides."""

_UNEVEN = 0.02
"""Part of a step that a period may have over a number of whole ones and count as divided by it: the
clocks of sender and logger differ by less."""

_LOST = 2.5
"""Pause in steps from which on samples are missing."""

_IN_TIME = 0.05
"""Share of updates that are taken to be shown as they come; the earliest of all may be jitter."""

_CHANCE = 1e-6
"""Probability from which on chance may have put all changes near such a raster."""

_COARSE = 2.1e-3
"""Step of a table [s] above which it matters how much later than its message a value is shown: with
rows of 2 ms, however their stamps are rounded, its time is known to a millisecond and better."""

_PAUSE = 1.5
"""After more than so many steps without a sample nobody knows when the value arrived."""


@dataclass(frozen=True)
class Raster:
    """Instants `start` + k·`period` [s] at which a logger shows the updates.

    Where the logger's step does not divide the period they come `early` [s] before that. Changes
    lie about it by `spread` [s], root of the mean square.
    """

    start: float
    period: float
    early: float = 0.0
    spread: float = 0.0


def find_raster(channel: Channel) -> Raster | None:
    """Return the update raster of a held channel; None where each sample may be an update.

    The period is the longest one, up to the shortest distance of two changes, on which all changes
    lie, of those near it the one to which they lie nearest; start and period are fitted by least
    squares so that clock drift does not add up. Where stamps jitter or messages are lost, it is the
    distance that most changes have.
    """
    raster = _raster_of(channel)
    if raster is None:
        period = repeat_period(channel)
        raster = None if period is None else Raster(float(channel.time[0]), period)
    return raster


def _raster_of(channel: Channel) -> Raster | None:
    """The raster by the stamps of a channel; None where there is none."""
    if channel.quantity is Quantity.STATE:
        return None
    changes = channel.time[1:][_changed(channel)]
    if changes.size < MIN_CHANGES:
        return None
    step, shortest = _step(channel), float(np.diff(changes).min())
    longest = min(shortest * (1.0 + _JITTER), MAX_PERIOD)
    whole = [(samples * step, _fit) for samples in range(round(longest / step), 1, -1)]
    between = [
        (period, _fit_between)
        for period in USUAL_PERIODS
        if _LEAST_STEPS * step < period < shortest + step + _BETWEEN_JITTER * period
        and _uneven(period, step)
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


def _step(channel: Channel) -> float:
    """Mean sample interval [s] less pauses: stamps that jitter move a median."""
    steps = np.diff(channel.time)
    return float(np.mean(steps[steps < _LOST * channel.step]))


def _changed(channel: Channel) -> NDArray[np.bool_]:
    """Mask (n-1,) of the samples, from the second on, with a new value; False after a pause."""
    pause = np.diff(channel.time) > _PAUSE * channel.step
    return np.asarray((np.diff(channel.values) != 0.0) & ~pause)


def _fit(changes: FloatArray, period: float, step: float) -> Raster | None:
    """Least-squares raster near `period` through the changes; None if they do not lie on one."""
    found = _line(changes, period)
    if found is None:
        return None
    start, slope, late = found
    most = float(np.abs(late).max())
    surely = most <= _JITTER_SAMPLES * step or _no_chance(_JITTER * slope, slope, changes.size)
    if most > _JITTER * slope or not surely or slope <= 1.5 * step:
        return None
    return _raster(start, slope, step, late)


def _fit_between(changes: FloatArray, period: float, step: float) -> Raster | None:
    """Fit the raster if the step does not divide the period; changes are up to a step late."""
    found = _line(changes, period)
    if found is None:
        return None
    start, slope, late = found
    most = 0.5 * step + _BETWEEN_JITTER * period
    as_usual = abs(slope - period) < 0.01 * period
    if np.abs(late).max() > most or not _no_chance(most, period, changes.size) or not as_usual:
        return None
    return _raster(start, slope, step, late)


def _raster(start: float, period: float, step: float, late: FloatArray) -> Raster:
    """The raster of which changes are `late` [s] (n,)."""
    spread = float(np.sqrt(np.mean(late**2)))
    return Raster(start, period, _early(period, step, late), spread)


def _no_chance(most: float, period: float, changes: int) -> bool:
    """Return True if changes within `most` [s] of a raster are unlikely to be a coincidence."""
    return (2.0 * most / period) ** (changes - 2) < _CHANCE


def _early(period: float, step: float, late: FloatArray) -> float:
    """Estimate the lead [s] of updates over the raster, given delays `late` (n,) after it.

    If the step does not divide the period, some updates arrive just before a sample. Otherwise the
    delay is constant and cannot be estimated; it is taken as zero.
    """
    return -float(np.quantile(late, _IN_TIME)) if _uneven(period, step) else 0.0


def _uneven(period: float, step: float) -> bool:
    """Return True if the period is not a multiple of the step."""
    steps = period / step
    return abs(steps - round(steps)) > _UNEVEN


def _line(changes: FloatArray, period: float) -> tuple[float, float, FloatArray] | None:
    """Start and period of the raster near `period` through the changes, and how much later each is
    (n,); None where two changes lie closer."""
    steps = np.round(np.diff(changes) / period)
    if steps.min() < 1.0:
        return None
    count = np.concatenate(([0.0], np.cumsum(steps)))
    slope, start = np.polyfit(count, changes, 1)
    return float(start), float(slope), np.asarray(changes - start - slope * count)


def _updates(channel: Channel, raster: Raster) -> tuple[NDArray[np.intp], FloatArray]:
    """Samples at which an update arrives, the change near each raster instant, else the instant,
    and which instant it is, counted.

    An instant at which the channel has no sample brings none.
    """
    margin = 0.5 * channel.step
    first = np.ceil((channel.time[0] - margin - raster.start) / raster.period)
    last = np.floor((channel.time[-1] + margin - raster.start) / raster.period)
    own = np.round((channel.time - raster.start) / raster.period)
    # Of a long pause no instant needs to be looked at.
    count = np.unique(np.concatenate((own - 1.0, own, own + 1.0)))
    count = count[(count >= first) & (count <= last)]
    instants = raster.start + raster.period * count
    nearest = np.minimum(np.searchsorted(channel.time, instants - margin), channel.time.size - 1)
    there = np.abs(channel.time[nearest] - instants) <= _PAUSE * channel.step
    changed = np.flatnonzero(_changed(channel)) + 1
    changed = changed[(own[changed] >= first) & (own[changed] <= last)]
    slot = np.searchsorted(count, own[changed])
    nearest[slot] = changed
    there[slot] = True
    samples, which = np.unique(nearest[there], return_index=True)
    return samples, count[there][which]


def fresh_samples(channel: Channel) -> Channel:
    """Return the channel reduced to the instants at which its value was updated.

    A channel that is not `held` is returned as it is. The value at such an instant is the newest
    the sender had, `te_delay` old; nothing is interpolated. Where the updates fall between the
    logger's samples, the instants are those of the raster.
    """
    if not channel.held:
        return channel
    raster = _raster_of(channel)
    if raster is not None:
        fresh, count = _updates(channel, raster)
        time = channel.time[fresh]
        if raster.early > 0.0:
            time = raster.start - raster.early + raster.period * count
        return replace(channel, time=time, values=channel.values[fresh], held=False)
    period = repeat_period(channel)
    if period is None:
        return channel
    fresh = updates_by_count(channel, period)
    return replace(channel, time=channel.time[fresh], values=channel.values[fresh], held=False)


def shown_late(channels: Mapping[str, Channel]) -> tuple[dict[str, Channel], list[str]]:
    """Mark channels with repeated values of a coarse table as `late`; return them with warnings.

    The arrival time of a message within a row is unknown. Channels with their own stamps have the
    stamps of the messages.
    """
    measured = {role: one for role, one in channels.items() if one.quantity not in AUXILIARY}
    held = [one for one in measured.values() if one.held]
    if not held:
        return dict(channels), []
    rows = max(measured.values(), key=lambda one: one.time.size)
    in_table = all(np.isin(one.time, rows.time).all() for one in measured.values())
    if not in_table or rows.step <= _COARSE:
        return dict(channels), []
    names = ", ".join(repr(one.source_name) for one in held)
    aged = {role: replace(one, late=rows.step) for role, one in measured.items()}
    return {**channels, **aged}, [
        f"the rows of the table are {1e3 * rows.step:.3g} ms apart and repeat values of {names}: a "
        "value stands there up to a row later than its message came, of each channel by another "
        "time; intervals count that, and the age of the engine torque, c_o, P0 and μ hang on it: "
        "export each channel with its own stamps, or rows of 1 ms; where all values of a row are "
        "of its stamp, say simultaneous = true under [time] of the channel mapping"
    ]


_LEAST = 30
"""Changes from which on their distances tell a period."""


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
"""The same as a part of the usual distance, on even stamps."""


_STAIRS = 1.5
"""Times the least of all changes above which one is no stair of a rounded signal ..."""


_LARGER = 0.2
"""... and the least share of such among changes at the usual distance: a signal that is not held
goes stair by stair where it does not change with each sample."""


_PAUSE = 1.5
"""Steps from an instant within which a message stands for it."""


def repeat_period(channel: Channel) -> float | None:
    """Period [s] of the updates of a channel whose values are repeated.

    None where each sample may be an update. On even stamps, where changes do jitter, those of a
    rounded signal may seem to be updates: there some must be larger than a step of the rounding.
    """
    changed = np.flatnonzero(np.diff(channel.values) != 0.0) + 1
    if channel.quantity is Quantity.STATE or changed.size < _LEAST:
        return None
    step = channel.step
    apart = np.maximum(np.diff(changed), np.diff(channel.time[changed]) / step)
    usual = round(float(np.median(apart)))
    near, close, least = _NEAR, _CLOSE, 0.0
    if np.abs(np.diff(channel.time) / step - 1.0).max() < _EVEN:
        near, close = max(near, _NEAR_PART * usual), max(close, _CLOSE_PART * usual)
        least = _LARGER
    at_usual = np.abs(apart - usual) < near
    often = np.mean(at_usual) > _MOST and np.mean(apart < close) < _SELDOM
    if usual <= 1 or not often:
        return None
    size = np.abs(np.diff(channel.values))[changed - 1]
    larger = np.mean(size[1:][at_usual] > _STAIRS * size.min())
    return usual * step if larger >= least else None


def updates_by_count(channel: Channel, period: float) -> NDArray[np.intp]:
    """Samples at which an update arrives: the changes, and between them one for each period."""
    changed = np.concatenate(([0], np.flatnonzero(np.diff(channel.values) != 0.0) + 1))
    last = channel.time.size - 1
    ends = channel.time[np.append(changed, last)]
    most = np.maximum(np.diff(np.append(changed, last)), 1)
    count = np.clip(np.round(np.diff(ends) / period), 1, most).astype(int)
    between = zip(pairwise(ends), count, strict=True)
    instants = np.concatenate([np.linspace(*p, n, endpoint=False)[1:] for p, n in between])
    nearest = np.searchsorted(channel.time, instants - 0.5 * channel.step)
    there = np.abs(channel.time[nearest] - instants) <= _PAUSE * channel.step
    return np.unique(np.concatenate((changed, nearest[there])))
