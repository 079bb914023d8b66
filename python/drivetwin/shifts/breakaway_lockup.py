# SPDX-License-Identifier: MIT
"""Phase boundaries of a shift: start of the torque phase, break-away and lock-up.

Break-away of the off-going and lock-up of the on-coming element follow from the slip alone.
Encoders on a bus send means over a period that is not the same for both shafts, so while the shaft
swings the two contradict each other by some per cent of what a shift changes, though the gear is
held. A slip counts as begun once it exceeds that; how much earlier it may have begun is in sigma.
Where the speeds come so slowly that no curve can be fitted, a few of them give the boundary.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray, compute_moving_mean
from drivetwin.channels.shiftlog import Channel
from drivetwin.shifts.changepoint import Hinge, Moving, fit_hinge
from drivetwin.shifts.shift import GearboxSpeeds, ShiftSettings

_SHARE = 0.05
"""Slip, as a part of what it changes by over the shift, that counts as begun."""
_LIMIT_slow_sampling = 4.0
"""Standard deviations of the noise beyond which a slip is no longer at rest."""
_STEEP = 3.0
"""Factor above the onset threshold at which the rate of a slip is evaluated."""
_LASTING = 3
"""So many samples at rest in a row are a gear held."""
_CALM = 2.0
"""Standard deviations of the noise within which these are."""


@dataclass(frozen=True)
class Boundary:
    """A phase boundary, at which a slip leaves or reaches zero: `time` ± `sigma` [s]."""

    time: float
    sigma: float


def locate_slip_start(time: FloatArray, slip: FloatArray, noise: float) -> Boundary | None:
    """Locate the start of a slip (n,) that ends away from rest; None without one.

    `slip` [rad/s] is that of the off-going element, 0 at rest, up to the lock-up of the other.
    """
    moved = np.abs(slip)
    limit = max(_SHARE * float(moved[-1]), _LIMIT_slow_sampling * noise)
    last = _find_last_rest_sample(moved, limit, noise)
    if last is None:
        return None
    at = _interpolate_crossing(time, moved, limit, last)
    calm = np.flatnonzero(moved[: last + 1] < _LIMIT_slow_sampling * noise)
    rest = int(calm[-1]) if len(calm) else 0
    # A slip that creeps is seen before it is large.
    at = min(at, float(time[min(rest + _LASTING, len(time) - 1)]))
    # The capacity falls steadily, so a slip grows at least with the square of the time.
    far = max(min(_STEEP * limit, 0.5 * float(moved[last:].max())), limit)
    steep = _interpolate_crossing(time, moved, far, last)
    hidden = (steep - at) / (np.sqrt(_STEEP) - 1.0)
    early = 0.5 * max(at - float(time[rest]), hidden)
    return Boundary(at, float(np.hypot(early, _compute_step_error(time, last))))


def _find_last_rest_sample(moved: FloatArray, limit: float, noise: float) -> int | None:
    """Return the last sample of the lasting rest; None without one, or if it ends the signal.

    A slip that turns after a flare passes through zero and does not rest there.
    """
    below = moved < limit
    calm = np.convolve(moved < min(_CALM * noise, limit), np.ones(_LASTING), "valid") >= _LASTING
    ends = np.flatnonzero(calm) + _LASTING - 1 if calm.any() else np.flatnonzero(np.cumprod(below))
    if not len(ends):
        return None
    # From there on it is at rest as long as it stays below.
    last = int(ends[-1]) + int(np.cumprod(below[ends[-1] :]).sum()) - 1
    return last if last + 1 < len(moved) else None


def _interpolate_crossing(time: FloatArray, moved: FloatArray, limit: float, last: int) -> float:
    """Interpolate the time [s] at which `moved` (n,) first exceeds `limit` after sample `last`."""
    above = last + int(np.argmax(moved[last:] >= limit))
    return float(np.interp(limit, moved[above - 1 : above + 1], time[above - 1 : above + 1]))


def locate_slip_end(time: FloatArray, slip: FloatArray, noise: float) -> Boundary | None:
    """Locate the end of a slip (n,) that starts away from rest; None if it never ends.

    `slip` [rad/s] is that of the on-coming element, 0 where it is locked.
    """
    limit = max(0.5 * _SHARE * float(np.abs(slip[0])), _LIMIT_slow_sampling * noise)
    calm = (np.abs(slip) < limit).astype(np.int64)
    lasting = np.flatnonzero(np.convolve(calm, np.ones(_LASTING), "valid") >= _LASTING)
    moving = np.flatnonzero(calm[: lasting[0]] == 0) if len(lasting) else np.empty(0, np.intp)
    if not len(moving):
        return None
    last = int(moving[-1])
    step = float(time[last + 1] - time[last])
    hidden = _extrapolate_to_rest(time[: last + 1], np.abs(slip[: last + 1]), limit)
    if hidden > step:
        return Boundary(
            float(time[last]) + hidden,
            float(np.hypot(0.5 * hidden, _compute_step_error(time, last))),
        )
    pace = float(slip[last] - slip[last + 1])
    share = float(np.clip(slip[last] / pace, 0.0, 1.0)) if pace != 0.0 else 1.0
    # Half of what the limit of rest hides, at the pace of the last step.
    reach = min(0.5 * limit / abs(pace), 1.0) if pace != 0.0 else 1.0
    return Boundary(
        float(time[last]) + share * step,
        float(np.hypot(reach * step, _compute_step_error(time, last))),
    )


def _extrapolate_to_rest(time: FloatArray, moved: FloatArray, limit: float) -> float:
    """Time [s] that a slip takes from its last number to zero, at its pace down to the limit.

    Returns zero if the decrease has too few samples for a rate.
    """
    high = int(np.flatnonzero(moved >= min(_STEEP * limit, 0.5 * float(moved.max())))[-1])
    fall = float(moved[high] - moved[-1])
    if len(moved) - 1 - high < _LASTING or fall <= 0.0:
        return 0.0
    return float(time[-1] - time[high]) * float(moved[-1]) / fall


def _compute_step_error(time: FloatArray, index: int) -> float:
    """Standard deviation [s] of an instant known to lie between two samples."""
    return float(time[index + 1] - time[index]) / float(np.sqrt(12.0))


_REST = 0.3
"""Span of held gear [s] from which level and noise of the slip at rest are taken."""
_QUIET = 0.04
"""Span [s] over which the slip must stay at rest to count as held."""
SMOOTH = 0.01
"""Span [s] over which slip, pressures and torque are averaged."""
_LEAST = 10
"""Fewest samples on either side of a boundary that a fit is made from."""
_LIMIT = 4.0
"""Standard deviations beyond which a smoothed slip is no longer at rest."""
_WINDOWS = (1.0, 0.5, 0.25)
"""Parts of the first window tried from wide to narrow."""
_CLEAR = 10.0
"""Standard deviations by which the slip has left rest at the end of the first window."""
_WIDEN = 4
"""Most times `hinge_window` that the first window may be."""
_BUS = 8e-3
"""Sample interval [s] from which speeds are taken for those of a bus."""
_ROUNDING = 2e-5
"""Least noise of a speed, relative: resolution of two decimals in rpm."""


def locate_break_away(
    speeds: GearboxSpeeds, ratio: float, held: tuple[int, int], stop: int, settings: ShiftSettings
) -> Boundary | None:
    """Locate break-away from the gear of `ratio`, engaged in samples `held`; None if not found.

    `stop` is the first sample at which the next gear is engaged.
    """
    begin, part = _select_samples(speeds, held[0], stop)
    first, last, stop = held[0] - begin, held[1] - begin, stop - begin
    rest = slice(max(first, last + 1 - speeds.count_samples(_REST, 8)), last + 1)
    slip = _compute_slip(part, ratio, rest, speeds.count_samples(SMOOTH, 3))
    span = slice(first, stop + 1)
    seen = locate_slip_start(slip.time[span], slip.error[span] - slip.level, slip.noise)
    if slip.stairs or _is_sparse(speeds, settings):
        return seen
    run = speeds.count_samples(_QUIET, 3)
    still = _find_true_runs(slip.deviation[: last + 1] < _LIMIT, run)
    anchor = max(int(still.max()) + run - 1, first) if len(still) else last
    window = _select_first_window(
        slip, anchor, Moving.AFTER, speeds.count_samples(settings.hinge_window, _LEAST)
    )
    found = _locate_hinge(slip, (anchor, window), Moving.AFTER, (first, stop))
    if found is None or seen is None or speeds.step < _BUS:
        return found
    # On a bus the two speeds are slightly inconsistent just before final break-away.
    doubt = 0.5 * max(seen.time - found.time, 0.0)
    return Boundary(found.time, float(np.hypot(found.sigma, doubt)))


def locate_lock_up(
    speeds: GearboxSpeeds, ratio: float, held: tuple[int, int], start: int, settings: ShiftSettings
) -> Boundary | None:
    """Locate lock-up of the gear of `ratio`, engaged in samples `held`; None if not found.

    `start` is the last sample at which the previous gear is engaged.
    """
    begin, part = _select_samples(speeds, start, held[1])
    first, last, start = held[0] - begin, held[1] - begin, start - begin
    rest = slice(first, min(last + 1, first + speeds.count_samples(_REST, 8)))
    slip = _compute_slip(part, ratio, rest, speeds.count_samples(SMOOTH, 3))
    if slip.stairs or _is_sparse(speeds, settings):
        span = slice(start, last + 1)
        return locate_slip_end(slip.time[span], slip.error[span] - slip.level, slip.noise)
    run = speeds.count_samples(_QUIET, 3)
    still = _find_true_runs(slip.deviation[first : last + 1] < _LIMIT, run)
    anchor = first + int(still.min()) if len(still) else first
    window = _select_first_window(
        slip, anchor, Moving.BEFORE, speeds.count_samples(settings.hinge_window, _LEAST)
    )
    return _locate_hinge(slip, (anchor, window), Moving.BEFORE, (start, last))


def _select_samples(speeds: GearboxSpeeds, first: int, last: int) -> tuple[int, GearboxSpeeds]:
    """Speeds of samples `first` to `last` with a margin for the smoothing, and where they begin."""
    margin = speeds.count_samples(SMOOTH, 3) + 1
    begin = max(first - margin, 0)
    return begin, speeds.select(begin, last + 1 + margin)


def _is_sparse(speeds: GearboxSpeeds, settings: ShiftSettings) -> bool:
    """Return True if the minimum number of samples of a fit exceeds the longest fit window."""
    return _LEAST * speeds.step > 2.0 * settings.hinge_window


@dataclass(frozen=True, eq=False)
class _Slip:
    """Synchronisation error (n,) on `time` [s], and how far it is from that of the gear held.

    `level` is the error at rest. `noise` [rad/s] is that of one sample at rest, at least `floor`.
    `deviation` (n,) is the distance, smoothed over SMOOTH, in standard deviations of the smoothed
    error; divided by `root` in those of a sample. `stairs`: the noise is that of rounding, alike
    over many samples, so that no curve can be fitted.
    """

    time: FloatArray
    error: FloatArray
    level: float
    floor: float
    noise: float
    deviation: FloatArray
    root: float
    stairs: bool


def _compute_slip(speeds: GearboxSpeeds, ratio: float, rest: slice, width: int) -> _Slip:
    """Slip of a gear that is held in the samples `rest`, smoothed over `width` samples."""
    error = speeds.compute_sync_error(ratio)
    level = float(np.median(error[rest]))
    noise = 1.4826 * float(np.median(np.abs(error[rest] - level)))
    floor = _ROUNDING * float(np.median(np.abs(speeds.input[rest])))
    rounding = speeds.estimate_rounding(ratio)
    noise = max(noise, floor, rounding)
    root = float(np.sqrt(width))
    mean = np.abs(compute_moving_mean(error - level, width))
    stairs = rounding > _estimate_white_noise(error[rest])
    return _Slip(speeds.time, error, level, floor, noise, mean * root / noise, root, stairs)


def _estimate_white_noise(error: FloatArray) -> float:
    """White noise of a slip at rest, from second differences: mostly zero between stairs."""
    bend = np.abs(np.diff(error, 2))
    return 1.4826 * float(np.median(bend)) / float(np.sqrt(6.0)) if len(bend) else 0.0


def _select_first_window(slip: _Slip, anchor: int, moving: Moving, shortest: int) -> int:
    """Samples from `anchor` on to where the slip has clearly left rest, within bounds."""
    ahead = slip.deviation[anchor:] if moving is Moving.AFTER else slip.deviation[anchor::-1]
    clear = np.flatnonzero(ahead > _CLEAR * slip.root)
    reached = int(clear[0]) if len(clear) else _WIDEN * shortest
    return int(np.clip(reached, shortest, _WIDEN * shortest))


def _find_true_runs(flags: NDArray[np.bool_], length: int) -> NDArray[np.intp]:
    """Indices at which `length` true flags in a row begin."""
    if len(flags) < length:
        return np.empty(0, dtype=np.intp)
    count = np.convolve(flags.astype(np.int64), np.ones(length, dtype=np.int64), "valid")
    return np.flatnonzero(count == length)


def _locate_hinge(
    slip: _Slip, where: tuple[int, int], moving: Moving, limits: tuple[int, int]
) -> Boundary | None:
    """Fit the hinge around sample `where[0]` in the widest window that the curve can follow.

    The widest tried has `where[1]` samples on either side; `limits` bound it in the log.
    Pressure vibration and a steep end bend the slip more than the curve can; narrower windows are
    tried then, and what the last narrowing moved counts as uncertainty.
    """
    anchor, widest = where
    time, sigma = float("nan"), float("inf")
    for part in _WINDOWS:
        span = max(round(part * widest), _LEAST)
        hinge = _locate_hinge_twice(slip, (anchor, span), moving, limits)
        if hinge is None:
            break
        moved = 0.0 if np.isnan(time) else abs(hinge.time - time)
        time, sigma = hinge.time, float(np.hypot(hinge.sigma, 0.5 * moved))
        anchor = int(np.searchsorted(slip.time, time))
        if hinge.noise_moving < slip.noise * (1.0 + 2.0 / np.sqrt(2.0 * span)):
            break
    if np.isnan(time):
        return None
    # Between two samples, further apart across a gap, the time is known to a uniform error only.
    after = int(np.clip(np.searchsorted(slip.time, time), 1, len(slip.time) - 1))
    step = float(slip.time[after] - slip.time[after - 1])
    return Boundary(time, float(np.hypot(sigma, step / np.sqrt(12.0))))


def _locate_hinge_twice(
    slip: _Slip, where: tuple[int, int], moving: Moving, limits: tuple[int, int]
) -> Hinge | None:
    """Fit the hinge around sample `where[0]` ± `where[1]`, then again around what was found."""
    anchor, span = where
    hinge: Hinge | None = None
    for _ in range(2):
        # A gentle onset hides in the noise, so it may lie well before what is first seen to move.
        before, after = (2 * span, span) if moving is Moving.AFTER else (span, span)
        low, high = max(limits[0], anchor - before), min(limits[1], anchor + after)
        rest, motion = span // 2, (2 * span) // 3
        begin, end = (span, motion) if moving is Moving.AFTER else (motion, rest)
        begin, end = max(anchor - begin, low + 2), min(anchor + end, high - 2)
        if end <= begin:
            return hinge
        window = slice(low, high + 1)
        interval = (float(slip.time[begin]), float(slip.time[end]))
        hinge = fit_hinge(slip.time[window], slip.error[window], moving, interval, slip.floor)
        if hinge is None:
            return None
        anchor = int(np.searchsorted(slip.time, hinge.time))
    return hinge


_DIP = 0.03
"""A torque dip must be this part of the torque after it, and clear of its noise."""
_BEGUN = 0.8
"""Part of the fall that is still ahead where its beginning is looked for."""
_AROUND = 0.15
"""Span [s] before that place in which the fall may have begun."""
_SHAFT = 0.015
"""A shaft of 10 Hz passes a fall on by so much later [s]."""


@dataclass(frozen=True, eq=False)
class SmoothedSignal:
    """A channel averaged over about SMOOTH; `noise` is what is left in `values` of its noise."""

    time: FloatArray
    values: FloatArray
    noise: float


def smooth_channel(channel: Channel, span: tuple[float, float]) -> SmoothedSignal:
    """Moving average of the finite samples within `span` [s], centred, so a ramp is kept."""
    keep = np.isfinite(channel.values) & (channel.time >= span[0]) & (channel.time <= span[1])
    time, values = channel.time[keep], channel.values[keep]
    width = 2 * round(0.5 * SMOOTH / channel.step) + 1
    if len(values) < width + 2:
        return SmoothedSignal(time, values, 0.0)
    noise = 1.4826 * float(np.median(np.abs(np.diff(values, 2)))) / np.sqrt(6.0 * width)
    return SmoothedSignal(time, compute_moving_mean(values, width), noise)


def locate_pressure_onset(
    pressure: SmoothedSignal, threshold: tuple[float, float], break_away: float
) -> Boundary | None:
    """Sustained crossing of P0 (`threshold`: value and standard deviation [Pa]); None if never.

    It is the last upward crossing before break-away, so that a filling pulse does not count, or
    the first one after it. Sigma spans the crossings of P0 ± (its own deviation and the noise).
    """
    value, std = threshold
    margin = float(np.hypot(std, pressure.noise))
    crossings = [
        _find_crossing(pressure, level, break_away)
        for level in (value - margin, value, value + margin)
    ]
    early, at, late = crossings
    if at is None:
        return None
    early = at if early is None else early
    late = 2.0 * at - early if late is None else late
    step = float(np.median(np.diff(pressure.time)))
    return Boundary(at, float(np.hypot(0.5 * max(late - early, 0.0), 0.3 * step)))


def _find_crossing(pressure: SmoothedSignal, level: float, break_away: float) -> float | None:
    """Time [s] of the upward crossing of `level` that lasts, or None."""
    above = pressure.values > level
    if not above.any():
        return None
    before = np.flatnonzero(pressure.time <= break_away)
    if len(before) and above[before[-1]]:
        below = np.flatnonzero(~above[: before[-1] + 1])
        index = int(below[-1]) + 1 if len(below) else 0
    else:
        start = int(before[-1]) + 1 if len(before) else 0
        later = np.flatnonzero(above[start:])
        if not len(later):
            return None
        index = start + int(later[0])
    if index == 0:
        return float(pressure.time[0])
    t, p = pressure.time[index - 1 : index + 1], pressure.values[index - 1 : index + 1]
    return float(t[0] + (level - p[0]) / (p[1] - p[0]) * (t[1] - t[0]))


def locate_torque_dip(torque: SmoothedSignal, break_away: float, step: float) -> Boundary | None:
    """Locate the onset of the torque dip towards break-away; None if there is no clear onset.

    Only for power-on upshifts, whose torque phase lowers the output torque by the ratios' `step`
    (new over old) at a steady engine torque. The onset is the start of the last such fall,
    since an earlier fall is caused by the driver; the delay of the shaft is subtracted. Sigma is
    that of the hinge fit, doubled because the fall need not be smooth, and that delay again.
    """
    keep = torque.time <= break_away
    time, values = torque.time[keep], torque.values[keep]
    if len(values) < 12:
        return None
    end = float(values[-1])
    fall = end * (1.0 / step - 1.0)
    if fall < max(_DIP * abs(end), 5.0 * torque.noise):
        return None
    whole = np.flatnonzero(values >= end + _BEGUN * fall)
    if not len(whole):
        return None
    at = float(time[whole[-1]])
    near = time >= at - _AROUND
    search = (max(at - 0.7 * _AROUND, float(time[near][2])), min(at + _SHAFT, float(time[-3])))
    if search[0] >= search[1]:
        return None
    floor = max(torque.noise, 1e-3 * abs(end))
    hinge = fit_hinge(time[near], values[near], Moving.AFTER, search, floor)
    if hinge is None:
        return None
    return Boundary(hinge.time - _SHAFT, float(np.hypot(2.0 * hinge.sigma, _SHAFT)))
