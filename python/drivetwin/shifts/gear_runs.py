# SPDX-License-Identifier: MIT
"""Detection of engaged gears: runs of samples with the speed ratio of a gear."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from drivetwin.shifts.kinematics import GearboxSpeeds
from drivetwin.shifts.settings import ShiftSettings

_NONE = -1
_STANDING = -2
_SPIKE = 5
"""Samples of the running median that keeps single wrong samples from ending a run."""


@dataclass(frozen=True)
class Run:
    """Samples `first` to `last` (both included) in one state: `gear` held, None for no gear."""

    gear: str | None
    first: int
    last: int


def detect_gear_runs(
    speeds: GearboxSpeeds, ratios: Mapping[str, float], settings: ShiftSettings
) -> list[Run]:
    """Cut the log into gears held and what lies between; standstill is left out.

    A ratio passed through counts as held only from `min_hold` on, and a disturbance shorter than
    `max_dropout` does not end a gear.
    """
    names = list(ratios)
    state = _classify_samples(speeds, list(ratios.values()), settings)
    time = speeds.time
    held = [
        Run(names[value], first, last)
        for value, first, last in _iterate_constant_runs(state)
        if value >= 0
    ]
    held = _merge_runs(held, time, settings.max_dropout)
    held = [run for run in held if time[run.last] - time[run.first] >= settings.min_hold]
    return _insert_gaps(held, state)


def _classify_samples(
    speeds: GearboxSpeeds, ratios: list[float], settings: ShiftSettings
) -> NDArray[np.int64]:
    """Index of the nearest gear within tolerance, or _NONE, or _STANDING; (n,)."""
    ratio = median_filter(speeds.input, _SPIKE, mode="nearest")
    output = median_filter(speeds.output, _SPIKE, mode="nearest")
    moving = output > settings.min_output_speed
    ratio = np.divide(ratio, output, out=np.zeros_like(ratio), where=moving)
    gears = np.array(ratios)
    distance = np.abs(ratio[:, None] / gears[None, :] - 1.0)
    nearest = distance.argmin(axis=1)
    tolerance = settings.ratio_tolerance + 5.0 * _estimate_ratio_noise(ratio, moving)
    # Between close gears the tolerance must not reach the neighbour.
    gap = np.diff(np.sort(np.log(gears))).min() if len(gears) > 1 else 1.0
    close = distance.min(axis=1) < min(tolerance, 0.25 * gap)
    return np.where(moving, np.where(close, nearest, _NONE), _STANDING).astype(np.int64)


def _estimate_ratio_noise(ratio: NDArray[np.float64], moving: NDArray[np.bool_]) -> float:
    """Relative white noise of the ratio, from second differences (blind to smooth change)."""
    bend = np.diff(ratio, 2)[moving[2:] & moving[:-2]]
    level = ratio[moving]
    if not len(bend):
        return 0.0
    return float(1.4826 * np.median(np.abs(bend)) / np.sqrt(6.0) / np.median(level))


def _iterate_constant_runs(state: NDArray[np.int64]) -> Iterator[tuple[int, int, int]]:
    """Yield (value, first, last) of every stretch of equal values."""
    edges = np.flatnonzero(np.diff(state)) + 1
    starts = np.concatenate([[0], edges])
    ends = np.concatenate([edges, [len(state)]]) - 1
    for first, last in zip(starts, ends, strict=True):
        yield int(state[first]), int(first), int(last)


def _merge_runs(held: list[Run], time: NDArray[np.float64], longest: float) -> list[Run]:
    joined: list[Run] = []
    for run in held:
        before = joined[-1] if joined else None
        if (
            before is not None
            and before.gear == run.gear
            and time[run.first] - time[before.last] <= longest
        ):
            joined[-1] = Run(run.gear, before.first, run.last)
        else:
            joined.append(run)
    return joined


def _insert_gaps(held: list[Run], state: NDArray[np.int64]) -> list[Run]:
    """Fill in what lies between the gears held, without standstill."""
    runs: list[Run] = []
    start = 0
    for run in [*held, Run(None, len(state), len(state))]:
        for value, first, last in _iterate_state_runs(state, start, run.first):
            if value != _STANDING:
                runs.append(Run(None, first, last))
        if run.gear is not None:
            runs.append(run)
        start = run.last + 1
    return runs


def _iterate_state_runs(
    state: NDArray[np.int64], start: int, stop: int
) -> Iterator[tuple[int, int, int]]:
    """Yield (value, first, last) in state[start:stop], all moving states counting as one."""
    if stop > start:
        part = np.where(state[start:stop] == _STANDING, _STANDING, _NONE)
        for value, first, last in _iterate_constant_runs(part.astype(np.int64)):
            yield value, start + first, start + last
