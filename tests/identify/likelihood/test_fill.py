# SPDX-License-Identifier: MIT
"""Noise about the fill point no longer adds capacity; elsewhere the pressure is as read."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.identify.likelihood.fill import near_fill
from drivetwin.identify.signals import PriorValue, Sampled

P0 = PriorValue(8e4, 0.0)
TIME = np.arange(0.0, 1.0, 1e-3)


def test_noise_at_the_kiss_point_is_averaged_out() -> None:
    rng = np.random.default_rng(3)
    noisy = Sampled(TIME, 8e4 + 7e3 * rng.standard_normal(TIME.size), 7e3)
    rectified = float(np.mean(np.maximum(noisy.values - P0.value, 0.0)))
    kept = float(np.mean(np.maximum(near_fill(noisy, P0) - P0.value, 0.0)))
    assert rectified == pytest.approx(0.4 * 7e3, rel=0.1)
    assert kept < 0.2 * rectified


def test_a_ramp_through_the_fill_point_keeps_its_shape() -> None:
    rng = np.random.default_rng(4)
    ramp = 3e6 * np.maximum(TIME - 0.3, 0.0)
    noisy = Sampled(TIME, ramp + 7e3 * rng.standard_normal(TIME.size), 7e3)
    smooth = near_fill(noisy, P0)
    assert np.array_equal(smooth[TIME > 0.4], noisy.values[TIME > 0.4])
    near = (TIME > 0.31) & (TIME < 0.35)
    assert np.std(smooth[near] - ramp[near]) < np.std(noisy.values[near] - ramp[near])


def test_an_ideal_sensor_is_left_alone() -> None:
    exact = Sampled(TIME, np.full(TIME.size, 8e4), 0.0)
    assert np.array_equal(near_fill(exact, P0), exact.values)
