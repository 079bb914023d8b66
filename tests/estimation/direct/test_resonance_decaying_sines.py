# SPDX-License-Identifier: MIT
"""Decaying sines: the truth without noise, the same minimum as a general least-squares search."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from drivetwin.estimation.direct.resonance import Windows, compute_misfits, fit_decaying_sines
from tests.support.arrays import FloatArray


def _make(
    size: int, rate: float, omega: float, noise: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    time = np.asarray(0.02 * np.arange(size), dtype=np.float64)
    swing = 3.0 * np.exp(-rate * time) * np.cos(omega * time + 0.4)
    jitter = noise * np.random.default_rng(size).normal(size=size)
    return time, np.asarray(150.0 + 4.0 * time - time**2 + swing + jitter)


@settings(max_examples=40, derandomize=True, deadline=None)
@given(
    rate=st.floats(0.2, 6.0),
    frequency=st.floats(4.0, 12.0),
    off=st.floats(-0.03, 0.03),
    sizes=st.lists(st.integers(30, 60), min_size=1, max_size=4),
)
def test_windows_of_different_lengths_without_noise_are_exact(
    rate: float, frequency: float, off: float, sizes: list[int]
) -> None:
    omega = 2.0 * np.pi * frequency
    made = [_make(size, rate, omega) for size in sizes]
    windows = Windows.stack([one[0] for one in made], [one[1] for one in made])
    found = fit_decaying_sines(windows, np.full(len(sizes), omega * (1.0 + off)), 2.0)
    assert found == pytest.approx(np.tile([rate, omega], (len(sizes), 1)), rel=1e-4)


@pytest.mark.parametrize("noise", [0.1, 0.5])
def test_the_minimum_is_that_of_a_general_search(noise: float) -> None:
    time, values = _make(50, 2.5, 40.0, noise)
    windows = Windows.stack([time], [values])
    found = fit_decaying_sines(windows, np.array([38.0]), 2.0)

    def misfit(p: FloatArray) -> FloatArray:
        fall = np.exp(-p[0] * time)
        basis = np.column_stack(
            [fall * np.cos(p[1] * time), fall * np.sin(p[1] * time), np.vander(time, 3)]
        )
        return np.asarray(values - basis @ np.linalg.lstsq(basis, values, rcond=None)[0])

    best = least_squares(misfit, (2.0, 38.0), xtol=1e-12, ftol=1e-12)
    assert found[0] == pytest.approx(best.x, rel=1e-4)
    assert compute_misfits(windows, found)[0] == pytest.approx(2.0 * best.cost, rel=1e-8)
