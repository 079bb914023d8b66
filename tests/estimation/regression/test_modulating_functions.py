# SPDX-License-Identifier: MIT
"""Kernel and derivative must match, on any time base and with any age of the samples."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.estimation.regression.modulating_functions import (
    build_hann_kernels,
    build_windows,
    join_windows,
)
from tests.support.arrays import FloatArray


def uneven(seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.uniform(0.5e-3, 1.5e-3, 1500))


@given(st.integers(0, 50), st.floats(-1e4, 1e4), st.floats(-1e3, 1e3))
def test_slope_of_a_line_is_exact_on_an_uneven_base(seed: int, level: float, rate: float) -> None:
    time = uneven(seed)
    windows = build_windows((0.1, 1.1), 0.4, 0.05)
    kernels = build_hann_kernels(time, windows)
    got = kernels.slope.matrix @ (level + rate * time)
    scale = abs(level) + abs(rate) + 1.0
    assert np.max(np.abs(got - rate * 0.5 * windows.width)) < 1e-9 * scale
    assert np.allclose(kernels.psi.matrix @ np.full(time.size, level), level * 0.5 * windows.width)


def test_slope_equals_kernel_of_the_derivative() -> None:
    time = np.arange(0.0, 2.0, 1e-3)
    windows = build_windows((0.1, 1.9), 0.4, 0.025)
    kernels = build_hann_kernels(time, windows)
    omega = 2 * np.pi * 3.0
    of_signal = kernels.slope.matrix @ np.sin(omega * time)
    of_derivative = kernels.psi.matrix @ (omega * np.cos(omega * time))
    assert np.max(np.abs(of_signal - of_derivative)) < 1e-4 * np.max(np.abs(of_derivative))


def test_age_shifts_the_stamps() -> None:
    time = np.arange(0.0, 2.0, 1e-2)
    windows = build_windows((0.3, 1.7), 0.4, 0.05)
    late = build_hann_kernels(time, windows, 0.037).psi.matrix @ np.sin(5.0 * (time - 0.037))
    prompt = build_hann_kernels(time, windows).psi.matrix @ np.sin(5.0 * time)
    assert late == pytest.approx(prompt, abs=1e-4)


def test_windows_fill_the_span_and_none_fits_a_shorter_one() -> None:
    windows = build_windows((1.0, 2.0), 0.4, 0.07)
    assert windows.start[0] == 1.0
    assert windows.start[-1] + 0.4 == pytest.approx(2.0)
    empty = build_windows((1.0, 1.3), 0.4, 0.07)
    assert empty.count == 0
    assert join_windows([windows, empty]).count == windows.count
