# SPDX-License-Identifier: MIT
"""Noise levels found in a signal that itself moves."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from drivetwin._util.signal_processing import estimate_rounding_step
from drivetwin.estimation.data.noise import estimate_white_noise


def test_noise_is_found_under_a_driveline_oscillation_and_a_step() -> None:
    rng = np.random.default_rng(1)
    time = np.arange(0.0, 6.0, 1e-3)
    signal = 2000.0 + 1500.0 * np.sin(2 * np.pi * 12.0 * time) + 3000.0 * (time > 3.0)
    noisy = signal + 30.0 * rng.standard_normal(time.size)
    assert estimate_white_noise(noisy) == pytest.approx(30.0, rel=0.05)


def test_rounding_step_is_found_and_none_where_values_are_continuous() -> None:
    rng = np.random.default_rng(2)
    values = 1000.0 + 20.0 * rng.standard_normal(400)
    assert estimate_rounding_step(11.0 * np.round(values / 11.0)) == pytest.approx(11.0)
    assert estimate_rounding_step(values) == 0.0


def test_a_rounding_step_is_found_where_ramps_alone_move_the_signal() -> None:
    """Rested on its levels and many steps apart along its ramps, each jump is a multiple of 11 but
    none is 11."""
    levels = 11.0 * np.array([50, 90, 37, 81, 49, 84])
    ramps = [np.linspace(a, b, 7)[:-1] for a, b in pairwise(levels)]
    values = np.concatenate([np.append(np.full(20, ramp[0]), ramp) for ramp in ramps])
    rounded = 11.0 * np.round(values / 11.0)
    jumps = np.abs(np.diff(rounded))
    assert jumps[jumps > 0.0].min() > 11.0
    assert estimate_rounding_step(rounded) == pytest.approx(11.0)
