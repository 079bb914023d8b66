# SPDX-License-Identifier: MIT
"""Break-away of the off-going and lock-up of the on-coming element, from the slip alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.shifts.hinge import Hinge, Moving, fit_hinge
from drivetwin.shifts.kinematics import GearboxSpeeds
from drivetwin.shifts.settings import ShiftSettings

FloatArray = NDArray[np.float64]

_REST = 0.3
"""Span of held gear [s] from which level and noise of the slip at rest are taken."""
_QUIET = 0.04
"""Span [s] over which the slip must stay at rest to count as held."""
_SMOOTH = 0.01
_LIMIT = 4.0
"""Standard deviations beyond which a smoothed slip is no longer at rest."""
_WINDOWS = (1.0, 0.5, 0.25)
"""Parts of `hinge_window` tried from wide to narrow."""
_ROUNDING = 2e-5
"""Least noise of a speed, relative: resolution of two decimals in rpm."""


@dataclass(frozen=True)
class Boundary:
    """A phase boundary, `time` ± `sigma` [s]."""

    time: float
    sigma: float


def break_away(
    speeds: GearboxSpeeds, ratio: float, held: tuple[int, int], stop: int, settings: ShiftSettings
) -> Boundary | None:
    """Where the gear of `ratio`, held in samples `held`, lets go; None if it cannot be told.

    `stop` is the first sample at which the next gear is held.
    """
    error = speeds.sync_error(ratio)[: stop + 1]
    first, last = held
    rest = slice(max(first, last + 1 - speeds.samples(_REST, 8)), last + 1)
    quiet = _quiet(speeds, error, rest)
    run = speeds.samples(_QUIET, 3)
    still = _runs_of_true(quiet[: last + 1], run)
    anchor = max(int(still.max()) + run - 1, first) if len(still) else last
    return _locate(speeds, error, anchor, Moving.AFTER, (first, stop, settings))


def lock_up(
    speeds: GearboxSpeeds, ratio: float, held: tuple[int, int], start: int, settings: ShiftSettings
) -> Boundary | None:
    """Where the gear of `ratio`, held in samples `held`, is reached; None if it cannot be told.

    `start` is the last sample at which the gear before is held.
    """
    error = speeds.sync_error(ratio)
    first, last = held
    rest = slice(first, min(last + 1, first + speeds.samples(_REST, 8)))
    quiet = _quiet(speeds, error, rest)
    run = speeds.samples(_QUIET, 3)
    still = _runs_of_true(quiet[first : last + 1], run)
    anchor = first + int(still.min()) if len(still) else first
    return _locate(speeds, error, anchor, Moving.BEFORE, (start, last, settings))


def _quiet(speeds: GearboxSpeeds, error: FloatArray, rest: slice) -> NDArray[np.bool_]:
    """Where the slip, smoothed over _SMOOTH, is that of the gear held in `rest`; (n,)."""
    width = speeds.samples(_SMOOTH, 3)
    level = float(np.median(error[rest]))
    noise = 1.4826 * float(np.median(np.abs(error[rest] - level)))
    floor = _ROUNDING * float(np.median(np.abs(speeds.input[rest])))
    mean = np.convolve(np.pad(error - level, width // 2, mode="edge"), np.ones(width), "same")
    mean = mean[width // 2 : width // 2 + len(error)] / width
    return np.asarray(np.abs(mean) < _LIMIT * max(noise, floor) / np.sqrt(width))


def _runs_of_true(flags: NDArray[np.bool_], length: int) -> NDArray[np.intp]:
    """Indices at which `length` true flags in a row begin."""
    if len(flags) < length:
        return np.empty(0, dtype=np.intp)
    count = np.convolve(flags.astype(np.int64), np.ones(length, dtype=np.int64), "valid")
    return np.flatnonzero(count == length)


def _locate(
    speeds: GearboxSpeeds,
    error: FloatArray,
    anchor: int,
    moving: Moving,
    limits: tuple[int, int, ShiftSettings],
) -> Boundary | None:
    """Fit the hinge in the widest window that the curve follows to within the noise.

    Pressure vibration and a steep end bend the slip more than the curve can; narrower windows are
    tried then, and what the last narrowing moved counts as uncertainty.
    """
    first, stop, settings = limits
    floor = _ROUNDING * float(np.abs(speeds.input[anchor]))
    time, sigma = float("nan"), float("inf")
    for part in _WINDOWS:
        span = speeds.samples(part * settings.hinge_window, 6)
        hinge = _centred(speeds, error, (anchor, span), moving, (first, stop, floor))
        if hinge is None:
            break
        moved = 0.0 if np.isnan(time) else abs(hinge.time - time)
        time, sigma = hinge.time, float(np.hypot(hinge.sigma, 0.5 * moved))
        anchor = int(np.searchsorted(speeds.time, time))
        if hinge.noise_moving < hinge.noise_still * (1.0 + 2.0 / np.sqrt(2.0 * span)):
            break
    if np.isnan(time):
        return None
    # Clocks of the two speeds are read to the sample: a uniform error of one step.
    return Boundary(time, float(np.hypot(sigma, speeds.step / np.sqrt(12.0))))


def _centred(
    speeds: GearboxSpeeds,
    error: FloatArray,
    where: tuple[int, int],
    moving: Moving,
    limits: tuple[int, int, float],
) -> Hinge | None:
    """Fit the hinge around sample `where[0]` ± `where[1]`, then again around what was found."""
    anchor, span = where
    first, stop, floor = limits
    hinge: Hinge | None = None
    for _ in range(2):
        low, high = max(first, anchor - span), min(stop, anchor + span)
        rest, motion = span // 2, (2 * span) // 3
        begin, end = (rest, motion) if moving is Moving.AFTER else (motion, rest)
        begin, end = max(anchor - begin, low + 2), min(anchor + end, high - 2)
        if end <= begin:
            return hinge
        window = slice(low, high + 1)
        interval = (float(speeds.time[begin]), float(speeds.time[end]))
        hinge = fit_hinge(speeds.time[window], error[window], moving, interval, floor)
        if hinge is None:
            return None
        anchor = int(np.searchsorted(speeds.time, hinge.time))
    return hinge
