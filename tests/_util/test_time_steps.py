# SPDX-License-Identifier: MIT
"""Results that are kept for stamps."""

from __future__ import annotations

import gc

import numpy as np
import pytest

from drivetwin._util.arrays import FloatArray
from drivetwin._util.time_steps import compute_median_step, is_time_axis, remember_for_stamps


def test_a_result_is_kept_as_long_as_the_stamps() -> None:
    calls: list[int] = []

    @remember_for_stamps
    def count(time: FloatArray) -> int:
        calls.append(time.size)
        return time.size

    for size in (20_000, 30_000):
        time = np.arange(float(size))
        assert count(time) == count(time) == size
        del time
        gc.collect()
    assert calls == [20_000, 30_000]
    short = np.arange(3.0)
    assert count(short) == count(short) == 3
    assert calls[2:] == [3, 3]


def test_the_median_step_is_that_of_the_array() -> None:
    for size in (2, 9_999, 10_000, 50_000):
        time = np.cumsum(np.random.default_rng(size).uniform(0.5, 1.5, size))
        assert compute_median_step(time) == float(np.median(np.diff(time)))


STEPS = np.arange(100.0)


@pytest.mark.parametrize(
    "time",
    [0.0 * STEPS, -STEPS, 1e300 * STEPS, 1e9 * STEPS, STEPS[:1], STEPS[:0],
     np.append(STEPS, np.nan), np.append(STEPS, np.inf), np.array([-1e308, 0.0, 1e308])],
)  # fmt: skip
def test_stamps_that_are_no_record(time: FloatArray) -> None:
    assert not is_time_axis(time)


@pytest.mark.parametrize("time", [STEPS, 1e-6 * STEPS, 1.7e9 + STEPS, 1e7 * STEPS])
def test_stamps_of_records(time: FloatArray) -> None:
    assert is_time_axis(time)
