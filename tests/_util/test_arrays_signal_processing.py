# SPDX-License-Identifier: MIT
"""Moving means near the ends of a record, rounding, runs, zero-phase low-pass."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, sosfiltfilt

from drivetwin._util.arrays import (
    compute_moving_mean,
    filter_zero_phase,
    find_large_steps,
)


@pytest.mark.parametrize("width", [1, 2, 5, 9, 10, 30])
@pytest.mark.parametrize("size", [0, 1, 2, 3, 9, 20])
def test_a_constant_is_kept_up_to_both_ends(width: int, size: int) -> None:
    assert compute_moving_mean(np.full(size, 8e5), width) == pytest.approx(np.full(size, 8e5))


@pytest.mark.parametrize("size", [0, 1, 2, 65535, 65536, 65537, 150_000])
def test_large_steps_are_found_across_the_parts_of_a_record(size: int) -> None:
    values = np.random.default_rng(size).standard_normal(size)
    expected = np.flatnonzero(np.abs(np.diff(values)) > 1.5)
    assert np.array_equal(find_large_steps(values, 1.5), expected)


@settings(derandomize=True)
@given(
    size=st.integers(16, 400), share=st.floats(1e-3, 0.45), seed=st.integers(0, 2**16),
    level=st.floats(-1e4, 1e4),
)  # fmt: skip
def test_equals_scipy(size: int, share: float, seed: int, level: float) -> None:
    values = level + np.cumsum(np.random.default_rng(seed).normal(size=size))
    step = 2e-3
    expected = sosfiltfilt(butter(2, share / step, fs=1.0 / step, output="sos"), values)
    found = filter_zero_phase(values, step, share / step)
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-7 * np.abs(values).max())
