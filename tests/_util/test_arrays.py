# SPDX-License-Identifier: MIT
"""Results that are kept for stamps."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin._util.arrays import compute_median_step, is_time_axis, remember_for_arrays
from tests.support.arrays import FloatArray


def test_a_result_is_kept_as_long_as_all_arrays() -> None:
    """An array in the place of one that is gone is not taken for it."""
    calls: list[float] = []

    @remember_for_arrays
    def add(time: FloatArray, values: FloatArray) -> float:
        calls.append(float(time[0] + values[0]))
        return calls[-1]

    time = np.zeros(5)
    for value in range(50):
        values = np.full(5, float(value))
        assert add(time, values) == add(time, values) == value
        del values
    assert calls == list(range(50))


def test_the_median_step_is_that_of_the_array() -> None:
    for size in (2, 9_999, 10_000, 50_000):
        time = np.cumsum(np.random.default_rng(size).uniform(0.5, 1.5, size))
        assert compute_median_step(time) == float(np.median(np.diff(time)))


STEPS = np.arange(100.0)


@pytest.mark.parametrize(
    "time",
    [0.0 * STEPS, -STEPS, 1e300 * STEPS, 1e9 * STEPS, STEPS[:1], STEPS[:0],
     np.append(STEPS, np.nan), np.append(STEPS, np.inf), np.array([-1e308, 0.0, 1e308]),
     1e-6 * STEPS, np.array([0.0, 1e308, 1.0]), np.append(0.0 * STEPS, 1.0)],
)  # fmt: skip
def test_stamps_that_are_no_record(time: FloatArray) -> None:
    assert not is_time_axis(time)


@pytest.mark.parametrize("time", [STEPS, 5e-5 * STEPS, 1.7e9 + STEPS, 1e7 * STEPS])
def test_stamps_of_records(time: FloatArray) -> None:
    assert is_time_axis(time)
