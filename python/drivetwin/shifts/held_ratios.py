# SPDX-License-Identifier: MIT
"""Ratios that the speeds of a gearbox hold, without knowledge of its gears."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.shifts.kinematics import GearboxSpeeds
from drivetwin.shifts.shift import ShiftSettings
from drivetwin.vehicle.spec import PriorValue

HOLD = 0.3
"""Shortest time at one ratio that counts as a gear [s]."""
RESTS = 1.0
"""Shortest rest of a ratio [s] that only a gear explains: the input speed of an open gearbox falls
or rises."""
_TOLERANCE = ShiftSettings().ratio_tolerance
"""Relative difference of a ratio that rounding, slip and noise explain."""
_WIDTH = 0.1
"""Width of the blocks [s] whose ratios are compared."""


@dataclass(frozen=True)
class HeldRatio:
    """A ratio of input and output speed, the time [s] for which it is held in all, and its standard
    deviation by the scatter of blocks."""

    ratio: float
    time: float
    std: float


def find_held_ratios(speeds: GearboxSpeeds, hold: float = HOLD) -> list[HeldRatio]:
    """Find the ratios that the speeds hold, from high to low, without knowledge of the gears.

    Blocks of `_WIDTH` are reduced to their ratio; neighbours of one ratio within half of the
    tolerance make a run, and runs of `hold` [s] and more count.
    """
    size = max(2, speeds.count_samples(_WIDTH, 2))
    count = speeds.time.size // size
    if count < 2:
        return []
    shape = (count, size)
    output = speeds.output[: count * size].reshape(shape).mean(axis=1)
    inlet = speeds.input[: count * size].reshape(shape).mean(axis=1)
    moving = output > ShiftSettings().min_output_speed
    ratio = np.divide(inlet, output, out=np.full(count, np.nan), where=moving)
    period = size * speeds.step
    found: list[HeldRatio] = []
    start = 0
    for stop in range(1, count + 1):
        if stop < count and abs(ratio[stop] / ratio[start] - 1) < 0.5 * _TOLERANCE:
            continue
        run = ratio[start:stop]
        if run.size * period >= hold and np.isfinite(run).all() and run[0] > 0.0:
            # The median of normal values scatters by √(π/2) times their mean.
            std = float(np.sqrt(0.5 * np.pi) * np.std(run, ddof=1) / np.sqrt(run.size))
            found.append(HeldRatio(float(np.median(run)), run.size * period, std))
        start = stop
    return merge_equal_ratios(found)


def merge_equal_ratios(found: Iterable[HeldRatio]) -> list[HeldRatio]:
    """Merge ratios that differ by less than the tolerance; from high to low."""
    merged: list[HeldRatio] = []
    for one in sorted(found, key=lambda each: -each.ratio):
        last = merged[-1] if merged else None
        if last is not None and last.ratio / one.ratio - 1 < _TOLERANCE:
            time = last.time + one.time
            shares = (last.time / time, one.time / time)
            ratio = shares[0] * last.ratio + shares[1] * one.ratio
            # What both runs differ by beyond noise, as with late speeds, stays in the mean.
            apart = shares[0] * shares[1] * abs(last.ratio - one.ratio)
            noise = np.hypot(shares[0] * last.std, shares[1] * one.std)
            merged[-1] = HeldRatio(ratio, time, float(max(noise, apart)))
        else:
            merged.append(one)
    return merged


def is_held(ratio: float, held: Sequence[HeldRatio]) -> bool:
    """Return True if one of the ratios that are held is this one."""
    return any(abs(one.ratio / ratio - 1) <= _TOLERANCE for one in held)


def is_ratio(found: HeldRatio, stated: PriorValue) -> bool:
    """Return True if a ratio that is held can be this one of the card.

    The tolerance is that of a rounded ratio, or the 95 % interval on the card where it is wider.
    """
    tolerance = max(_TOLERANCE * stated.value, stated.half_width or 0.0)
    return abs(found.ratio - stated.value) <= tolerance
