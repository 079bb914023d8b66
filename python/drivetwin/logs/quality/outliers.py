# SPDX-License-Identifier: MIT
"""Detection of damaged samples of a channel. They are dropped and reported, not replaced."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import (
    compute_median_step,
    estimate_resolution,
    find_large_steps,
    find_largest,
    find_run_bounds,
    find_true_runs,
    remember_for_arrays,
    sample_blocks,
)
from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel, FloatArray
from drivetwin.errors import Where
from drivetwin.findings import Code, Finding, report

Mask = NDArray[np.bool_]

_LISTED = 3
"""So many places are named; more are counted."""

_SPIKE_WIDTH = 3
"""Longest spike in samples."""

_SPIKE_CONTRAST = 5.0
"""A spike stands out by so many times the largest step of its surroundings ..."""

_STEP_INTO_SPIKE = 0.8
"""Least step into a spike as a share of its height."""

_SURROUNDINGS = 12
"""... which are so many samples on both sides."""

_SPIKE_SHARE = 0.05
"""Least height of a spike as a share of the channel's range without its extremes."""

_SPIKE_TIME = 5e-3
"""Longest spike [s] of a torque or pressure, which may truly change that fast; speeds may not."""

_PULSE_TIME = 0.025
"""Longest stretch [s] that a shaft's torque may have jumped to and back from by a disturbance."""

_STUCK_TIME = 0.25
"""Shortest time [s] of one repeated number that may be a stuck signal."""

_STUCK_SAMPLES = 10
_STUCK_RELEASE = 8.0
"""A stuck signal jumps at its end by so many usual steps ..."""

_ENOUGH, _MOVING = 100, 0.9
"""... or its numbers hardly ever repeat: of so many other steps such a share moves, ..."""

_BEFORE, _RESTLESS, _ALIVE = 20, 5, 0.2
"""... and noise stops or starts with the repeat: so many turns in so many steps of at least
this share of the usual size.
"""

_JITTER = 0.3
"""Least share of steps that move for a coarse signal to jitter."""

_TWO_NEIGHBOURS = 2.0
_WIDE_TURNS = (0.0, 0.03, 0.075, 0.12, 0.22, 0.3, 0.5, 0.6)
_NOISES = (0.0, 0.4, 0.5, 0.6, 0.8, 1.0, 2.0, 5.0)
"""Share of steps that turn over more than two neighbouring codes, by the deviation of normal noise
in codes: simulated, and within a tenth the same wherever the true value lies."""

_DITHER, _REPEATING = 0.3, 0.5
"""Deviation of the noise in codes below which rounding errors stay alike from sample to sample, and
the least share of samples that then repeat the one before."""

_UNLIKELY = float(np.log(1e-9))
"""Logarithm of the chance below which a rest is none of the jitter's own."""

_DROP = 0.3
"""Least step into and out of a dropout as a share of the signal's level; that of a spike is enough
where the signal is calm before or after, and goes on from where it fell."""

_DROP_TIME = 0.25
"""Longest such dropout [s]."""

BEYOND = 2.0
"""A number is no measurement if it is so many times as large as any other of the log ..."""

_BEYOND_STEP = 0.025
"""... and reached in one sample, with no more than so much time [s] for it, ..."""

_BEYOND_TIME, _OTHERS = 0.5, 10
"""... left likewise, and one number for no longer than this [s], while the rest, which is more than
half, takes so many numbers at least."""

_BEYOND_AT_END = 3.0
"""So many times as large at the start or end of a log, where it is only left or only reached."""

_LIFT = 3.0
"""A fill pulse leaves a pressure higher by so many times what it moved by before, in the same time,
or by so many of its steps."""

_LOST = 2
"""Most messages in a row that are lost while the value before them is shown on, ..."""

_MOVES = 4.0
"""... detected by a slope about it of so many times resolution and noise of a step, so that numbers
do not repeat by chance, ..."""

_CATCHES_UP = 1.5
"""... and by a step after it of at most so many times what is missing by the one before it: a
signal that sets off from rest may repeat a number just before."""

_THIRD_DIFFERENCE = 3.02
"""Median size of the third difference of unit white noise, 0.6745·sqrt(20)."""

_LEVELS = 1 << 17
"""Evenly spread samples that show a quantile of a record [count]: cost of work."""

_CLIPPED_SAMPLES = 3
_CLIPPED_RUNS = 3
"""A limit is reached in so many runs of so many equal samples, or in fewer longer ones ..."""

_TURNING = 1.0 / 3.0
"""... of a signal that turns in this share of its steps: half of that of white noise."""


@dataclass(frozen=True, eq=False)
class Damage:
    """Samples (n,) that are no measurement, and the code of the finding on them."""

    mask: Mask
    code: Code

    def report(self, time: FloatArray, place: Where) -> Finding:
        """Report how many of the samples at `time` (n,) are damaged, and where."""
        runs = find_true_runs(self.mask)
        places = ", ".join(
            f"at {time[start]:.3f} s"
            if end - start == 1
            else f"from {time[start]:.3f} s to {time[end - 1]:.3f} s"
            for start, end in runs[:_LISTED]
        )
        if len(runs) > _LISTED:
            places += f" and {len(runs) - _LISTED} more times"
        samples = int(self.mask.sum())
        return report(self.code, "", place, samples=samples, runs=len(runs), places=places)


def _make_damage(mask: Mask, code: Code) -> Damage | None:
    return Damage(mask, code) if mask.any() else None


def find_missing(values: FloatArray) -> Damage | None:
    """Samples without a number."""
    return _make_damage(~np.isfinite(values), Code.SAMPLES_MISSING)


def find_spikes(time: FloatArray, values: FloatArray, quantity: Quantity) -> Damage | None:
    """Up to three samples that leave the signal and return to it, far beyond its usual steps."""
    mask = np.zeros(values.size, np.bool_)
    if quantity is Quantity.STATE or values.size < 4 * _SURROUNDINGS:
        return None
    least = max(
        _SPIKE_SHARE * _compute_usual_range(values), _SPIKE_CONTRAST * compute_usual_step(values)
    )
    interval = compute_median_step(time)
    entered = find_large_steps(values, _STEP_INTO_SPIKE * least)
    for width in range(1, _SPIKE_WIDTH + 1):
        if quantity is not Quantity.SPEED and width * interval > _SPIKE_TIME:
            break
        for start in _find_spike_starts(values, entered, width, least):
            mask[start : start + width] = True
    mask |= np.isin(values, _list_codes(values, mask))
    return _make_damage(mask, Code.SPIKES)


def _list_codes(values: FloatArray, spikes: Mask) -> FloatArray:
    """List the numbers of several spikes beyond all other values: codes of an invalid value, also
    where they stand for longer."""
    numbers, counts = np.unique(values[spikes], return_counts=True)
    repeated = numbers[counts > 1]
    others = values[~np.isin(values, repeated)]
    if not others.size:  # two levels, of which each makes spikes in the other
        return others
    low, high = others.min(), others.max()
    return np.asarray(repeated[(repeated < low) | (repeated > high)])


def _find_spike_starts(
    values: FloatArray, entered: NDArray[np.intp], width: int, least: float
) -> NDArray[np.intp]:
    """First samples of spikes of one width: both neighbours agree, the rest around is calm.

    The neighbours differ by a fifth of the height at most, so that the step into a spike has nine
    tenths of it; only the samples before such a step, `entered` (m,), are looked at.
    """
    before = entered[entered < values.size - width - 1]
    after = before + width + 1
    apart = np.abs(values[after] - values[before])
    inside = np.lib.stride_tricks.sliding_window_view(values[1:-1], width)[before]
    inside = inside - 0.5 * (values[before] + values[after])[:, None]
    height = np.abs(inside).min(axis=1, initial=np.inf)
    height[np.abs(np.sign(inside).sum(axis=1)) < width] = 0.0
    # Largest step in the windows that end before and start after the spike; none beyond the ends.
    beside = np.arange(_SURROUNDINGS + 1)
    left, right = (
        np.abs(np.diff(values[rows.clip(0, values.size - 1)])).max(axis=1, initial=0.0)
        for rows in (before[:, None] - beside, after[:, None] + beside)
    )
    around = np.maximum(np.maximum(left, right), apart)
    found = (height > least) & (height > _SPIKE_CONTRAST * around)
    return np.asarray(before[found] + 1)


def _compute_median(values: FloatArray) -> float:
    """Compute the median of an array that nobody else needs: it is partly sorted in place."""
    return float(np.median(values, overwrite_input=True))


@remember_for_arrays
def compute_usual_step(values: FloatArray) -> float:
    """Compute the median size of the steps of `values` (n,) that move; 0 without any."""
    steps = np.abs(np.diff(sample_blocks(values)))
    moving = steps[steps > 0.0]
    if moving.size < _ENOUGH:  # a record that mostly rests
        steps = np.abs(np.diff(values))
        moving = steps[steps > 0.0]
    return _compute_median(moving) if moving.size else 0.0


@remember_for_arrays
def _compute_usual_range(values: FloatArray) -> float:
    """Compute the range of `values` (n,) without the extreme two percent on each side."""
    return float(np.ptp(np.percentile(_thin(values), [2, 98])))


def _thin(values: FloatArray) -> FloatArray:
    """Return evenly spread samples of `values` (n,) that show how often a level is reached."""
    return values[:: max(1, values.size // _LEVELS)]


def find_glitches(time: FloatArray, values: FloatArray) -> Damage | None:
    """Stretches, longer than spikes, that a calm torque jumps to and back from in one sample each.

    In between it goes on as it would have without the jump, as where an amplifier is disturbed. A
    knock in the backlash of a driveline rises and falls over several samples.
    """
    if values.size < 4 * _SURROUNDINGS:
        return None
    least = max(
        _SPIKE_SHARE * _compute_usual_range(values), _SPIKE_CONTRAST * compute_usual_step(values)
    )
    mask = np.zeros(values.size, np.bool_)
    for first, last in pairwise(find_large_steps(values, least)):
        width = int(last - first)
        if width <= _SPIKE_WIDTH or time[last] - time[first] > _PULSE_TIME:
            continue
        beside = (values[max(0, first - _SURROUNDINGS) : first + 1], values[first + 1 : last + 1],
                  values[last + 1 :][: _SURROUNDINGS + 1])  # fmt: skip
        calm = max(np.abs(np.diff(part)).max(initial=0.0) for part in beside)
        into, out = values[first + 1] - values[first], values[last + 1] - values[last]
        if min(abs(into), abs(out)) > _SPIKE_CONTRAST * max(calm, abs(into + out)):
            mask[first + 1 : last + 1] = True
    return _make_damage(mask, Code.GLITCHES)


def find_stuck(channel: Channel) -> Damage | None:
    """Stretches in which a varying signal repeats one number as it never does elsewhere.

    Noise stops at the start or comes back at the end, or it is a speed, which cannot jump, and
    jumps at the end. Standstill is none, nor a signal without noise that comes to rest or starts
    from rest by itself.
    """
    time, values = channel.time, channel.values
    same = values[1:] == values[:-1]
    changes = same.size - int(np.count_nonzero(same))
    usual = compute_usual_step(values) if changes else np.inf
    long = find_true_runs(same, _STUCK_SAMPLES)
    outside = same.size - sum(end - start for start, end in long)
    fine = outside >= _ENOUGH and changes > _MOVING * outside
    least = _STUCK_RELEASE * usual
    mask = np.zeros(values.size, np.bool_)
    for start, end in long:
        if values[start] == 0.0:
            continue
        slow = channel.quantity is Quantity.SPEED and time[end] - time[start] >= _STUCK_TIME
        released = end < same.size and abs(values[end + 1] - values[end]) > least
        before, after = values[max(0, start - _BEFORE) : start + 1], values[end:][: _BEFORE + 1]
        beside = (np.diff(before), np.diff(after))
        noisy = any(_is_noisy(some, usual) for some in beside)
        if (slow and released) or (fine and noisy):
            # The first is the last that was measured, unless the signal jumped to it.
            jumped = start == 0 or abs(values[start] - values[start - 1]) > least
            mask[start if jumped else start + 1 : end + 1] = True
    return _make_damage(mask, Code.STUCK)


def find_stale(values: FloatArray) -> Damage | None:
    """Updates (n,) that repeat the one before while the signal moves on and then catches up.

    Lost messages cause such repeats. Where the signal turns or rests, a repeat may be genuine.
    """
    if values.size < 4 * _SURROUNDINGS:
        return None
    starts, ends = find_run_bounds(values[1:] == values[:-1])
    inner = (starts > 0) & (ends < values.size - 1) & (ends - starts <= _LOST)
    starts, ends = starts[inner], ends[inner]
    into, out = values[starts] - values[starts - 1], values[ends + 1] - values[ends]
    before, after, lost = np.abs(into), np.abs(out), ends - starts
    onwards = into * out > 0.0
    catches_up = (before < after) & (after < _CATCHES_UP * (lost + 1) * before)
    moved = (before + after) / (lost + 2) / _MOVES
    found = onwards & catches_up & (moved >= _estimate_white_noise(values))
    if found.any():  # the resolution takes longer than the noise
        found &= moved >= estimate_resolution(values)
    mask = np.zeros(values.size, np.bool_)
    for start, end in zip(starts[found].tolist(), ends[found].tolist(), strict=True):
        mask[start + 1 : end + 1] = True
    return _make_damage(mask, Code.MESSAGES_LOST)


def _estimate_white_noise(values: FloatArray) -> float:
    """Standard deviation of the noise of `values` (n,) from its third difference."""
    return _compute_median(np.abs(np.diff(sample_blocks(values), 3))) / _THIRD_DIFFERENCE


def _is_noisy(steps: FloatArray, usual: float) -> bool:
    """Return True if successive steps are as large as usual and turn as noise does."""
    turns = np.count_nonzero(np.diff(np.sign(steps)))
    return bool(turns >= _RESTLESS and np.median(np.abs(steps)) > _ALIVE * usual)


def find_longest_rest(time: FloatArray, values: FloatArray) -> tuple[float, float] | None:
    """Longest span [s] of one number, if a signal that jitters would not rest so by itself.

    Noise below the resolution rests where the true value lies in the middle between two changes of
    the rounded one, so that is what the chance of so long a rest is reckoned for.
    """
    still = np.diff(values) == 0.0
    found = find_true_runs(still)
    if not found or still.all():
        return None
    start, end = max(found, key=lambda run: run[1] - run[0])
    elsewhere = np.concatenate([values[: start + 1], values[end:]])
    moving = np.diff(elsewhere) != 0.0
    if values[start] == 0.0 or moving.size < _ENOUGH or np.mean(moving) < _JITTER:
        return None
    noise = _estimate_noise(elsewhere / estimate_resolution(elsewhere))
    unlikely = (
        (end - start) * np.log(math.erf(0.5 / (np.sqrt(2.0) * noise))) if noise > 0.0 else 0.0
    )
    return (float(time[start]), float(time[end])) if unlikely < _UNLIKELY else None


def detect_quantization(values: FloatArray) -> float:
    """Resolution of a signal that goes in stairs, being rounded beyond its noise; else 0."""
    step = estimate_resolution(values)
    if step == 0.0 or np.mean(np.diff(values) == 0.0) < _REPEATING:
        return 0.0
    return step if _estimate_noise(values / step) < _DITHER else 0.0


def _estimate_noise(codes: FloatArray) -> float:
    """Standard deviation of the noise before rounding to whole `codes` (n,), in their unit.

    Alternation between two adjacent codes is no evidence of noise, since the true value may lie
    between them. Alternation over three or more codes is.
    """
    steps = np.round(np.diff(codes))
    turns = steps[1:] * steps[:-1] < 0.0
    wide = np.abs(steps[1:]) + np.abs(steps[:-1]) > _TWO_NEIGHBOURS
    return float(np.interp(np.mean(turns & wide), _WIDE_TURNS, _NOISES))


def find_dropouts(time: FloatArray, values: FloatArray) -> Damage | None:
    """Stretches of exact zeros that the signal falls to, and leaves, in one step."""
    level = float(np.percentile(np.abs(_thin(values)), 98.0))
    mask = np.zeros(values.size, np.bool_)
    for start, end in find_true_runs(values == 0.0):
        if start == 0 or end == values.size:
            continue
        least = _DROP * level
        if time[end] - time[start] <= _DROP_TIME:
            before, after = values[:start][-_SURROUNDINGS - 1 :], values[end:][: _SURROUNDINGS + 1]
            before, after = np.abs(np.diff(before)), np.abs(np.diff(after))
            apart = abs(float(values[end] - values[start - 1]))
            calm = min(before.max(initial=apart), after.max(initial=apart))
            least = min(least, max(_SPIKE_SHARE * level, _SPIKE_CONTRAST * calm))
        if min(abs(values[start - 1]), abs(values[end])) > least:
            mask[start:end] = True
    return _make_damage(mask, Code.DROPOUTS)


def find_outliers(time: FloatArray, values: FloatArray, possible: float = 0.0) -> Damage | None:
    """Short stretches of one number far beyond all others, entered and left in one step.

    Invalid-value codes (as -9999) and values of a message that was not received, at the start of a
    log also of one that was not received yet. What is positive and not above `possible`
    may have been commanded: at the ends of the log, and where it is a fill pulse, it stays.
    """
    if compute_median_step(time) > _BEYOND_STEP:
        return None
    least = find_largest(values) / BEYOND
    large = np.count_nonzero(values >= least) + np.count_nonzero(values <= -least)
    if 2 * large > values.size:  # the median is no smaller
        return None
    size = np.abs(values)
    if size.max() <= BEYOND * np.median(size):
        return None
    sizes = np.unique(size)
    far = np.flatnonzero(sizes[1:] > BEYOND * sizes[:-1])
    for largest in sizes[far[sizes[far] >= np.median(size)]]:
        mask = size > largest
        found = find_true_runs(mask)
        if (
            np.unique(values[~mask]).size >= _OTHERS
            and _has_only_inserted_runs(time, values, found, float(largest))
            and not any(_can_be_fill_pulse(values, run, possible) for run in found)
        ):
            return Damage(mask, Code.OUTLIERS)
    return None


def _has_only_inserted_runs(
    time: FloatArray, values: FloatArray, found: Sequence[tuple[int, int]], largest: float
) -> bool:
    """Return True if each stretch is constant, short, and surrounded by other values.

    At the ends of the log, a larger margin over `largest`, the largest other value, is required.
    """
    return all(
        ((start > 0 and end < values.size) or abs(values[start]) > _BEYOND_AT_END * largest)
        and time[min(end, values.size - 1)] - time[start] <= _BEYOND_TIME
        and np.all(values[start:end] == values[start])
        for start, end in found
    )


def _can_be_fill_pulse(values: FloatArray, run: tuple[int, int], possible: float) -> bool:
    """Return True if a constant stretch may be a clutch fill pulse or is cut off by the log's ends.

    A fill pulse starts from rest and ends at a higher pressure. After an invalid-value code the
    signal continues its previous course.
    """
    start, end = run
    if not 0.0 < values[start] <= possible:
        return False
    if start == 0 or end == values.size:
        return True
    before = values[max(0, start - max(end - start, _SURROUNDINGS)) : start]
    usual = max(float(np.ptp(before)), estimate_resolution(values))
    return float(values[end] - values[start - 1]) > _LIFT * usual


def find_clipping(values: FloatArray) -> Damage | None:
    """Samples at the largest or smallest number, where a fine signal rests there and nowhere else.

    A regulated signal without noise may rest at its largest number once.
    """
    limits = [float(values.max()), float(values.min())]
    same = find_true_runs(values[1:] == values[:-1], _CLIPPED_SAMPLES - 1)
    if any(values[start] not in limits for start, _ in same):
        return None
    mask = np.zeros(values.size, np.bool_)
    for limit in (one for one in limits if one != 0.0):
        at_limit = values == limit
        rests = find_true_runs(at_limit, _CLIPPED_SAMPLES)
        samples = sum(end - start for start, end in rests)
        often = len(rests) >= _CLIPPED_RUNS and len(rests) == len(same)
        if often or (samples >= _CLIPPED_SAMPLES * _CLIPPED_RUNS and _turns(values[~at_limit])):
            mask |= at_limit
    return _make_damage(mask, Code.SATURATED)


def _turns(values: FloatArray) -> bool:
    """Return True if a signal (n,) turns from step to step as one with noise does."""
    steps = np.diff(values)
    return steps.size >= _ENOUGH and bool(np.mean(steps[1:] * steps[:-1] < 0.0) > _TURNING)
