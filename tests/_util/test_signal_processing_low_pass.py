# SPDX-License-Identifier: MIT
"""Zero-phase low-pass: equal to SciPy's, keeps constants and ramps, damps by the square."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, sosfiltfilt

from drivetwin._util.signal_processing import filter_zero_phase


@settings(max_examples=50, derandomize=True)
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


def test_keeps_a_ramp_away_from_the_ends() -> None:
    ramp = 3.0 + 0.5 * np.arange(600.0)
    found = filter_zero_phase(np.asarray(ramp, dtype=np.float64), 1e-3, 30.0)
    assert found[200:400] == pytest.approx(ramp[200:400], rel=1e-9)


def test_halves_the_amplitude_at_the_cutoff() -> None:
    time = np.arange(0.0, 4.0, 1e-3)
    swing = np.cos(2.0 * np.pi * 20.0 * time)
    middle = slice(1000, 3000)
    found = filter_zero_phase(swing, 1e-3, 20.0)[middle]
    assert found == pytest.approx(0.5 * swing[middle], abs=1e-3)
