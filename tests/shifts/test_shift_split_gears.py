# SPDX-License-Identifier: MIT
"""Gears between shifts divided in their middle."""

from __future__ import annotations

import numpy as np

from drivetwin.shifts.shift import (
    Shift,
    compute_exclusive_masks,
    compute_exclusive_spans,
    split_shared_gears,
)
from drivetwin.vehicle.spec import ShiftKind


def shift(start: float, lockup: float, gears: tuple[float, float]) -> Shift:
    """A shift from `start` to `lockup` with the gears held between the times `gears`."""
    middle = 0.5 * (start + lockup)
    return Shift(
        "2", "3", "B2", "B3", ShiftKind.POWER_ON_UP,
        before=(gears[0], start), torque_phase=(start, middle), inertia_phase=(middle, lockup),
        after=(lockup, gears[1]), lockup_time=lockup,
    )  # fmt: skip


CHAIN = (shift(2.0, 3.0, (0.0, 7.0)), shift(7.0, 8.0, (3.0, 12.0)), shift(12.0, 13.0, (8.0, 14.0)))


def test_shifts_apart_share_no_sample() -> None:
    assert compute_exclusive_spans(CHAIN) == ((0.0, 5.0), (5.0, 10.0), (10.0, 14.0))
    one, other, last = split_shared_gears(CHAIN)
    assert one.after[1] == other.before[0] == 5.0
    assert other.after[1] == last.before[0] == 10.0
    assert one.before == CHAIN[0].before
    assert last.after == CHAIN[2].after


def test_each_instant_is_one_shifts_own() -> None:
    times = [np.arange(one.before[0], one.after[1] + 0.25, 0.5) for one in CHAIN]
    own = compute_exclusive_masks(CHAIN, times)
    left = np.concatenate([time[kept] for time, kept in zip(times, own, strict=True)])
    assert np.array_equal(left, np.arange(0.0, 14.25, 0.5))


def test_a_gear_of_which_less_counts_is_not_divided() -> None:
    one, other = shift(2.0, 3.0, (0.0, 6.0)), shift(20.0, 21.0, (12.0, 24.0))
    assert compute_exclusive_spans((one, other)) == ((0.0, 6.0), (12.0, 24.0))
