# SPDX-License-Identifier: MIT
"""Noise of a pressure is taken off, its own motion and its corners are not."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.likelihood.input_smoothing import smooth_pressure
from drivetwin.likelihood.measured_signal import MeasuredSignal
from drivetwin.vehicle.spec import PriorValue
from tests.support.arrays import FloatArray

P0 = 8e4
TIME = np.arange(0.0, 1.0, 1e-3)


def test_noise_at_the_kiss_point_adds_less_to_the_capacity() -> None:
    rng = np.random.default_rng(3)
    noisy = MeasuredSignal(TIME, P0 + 7e3 * rng.standard_normal(TIME.size), 7e3)
    rectified = float(np.mean(np.maximum(noisy.values - P0, 0.0)))
    kept = float(np.mean(np.maximum(smooth_pressure(noisy) - P0, 0.0)))
    assert rectified == pytest.approx(0.4 * 7e3, rel=0.1)
    assert kept < 0.5 * rectified


def test_a_vibrating_valve_keeps_its_amplitude() -> None:
    wave = 5e5 + 2.5e4 * np.sin(2.0 * np.pi * 18.0 * TIME)
    smooth = smooth_pressure(MeasuredSignal(TIME, wave, 7e3))
    assert np.max(np.abs(smooth - wave)[20:-20]) < 2e-3 * 2.5e4


def test_a_sharp_corner_stays_as_read_and_a_ramp_stays_a_ramp() -> None:
    rng = np.random.default_rng(4)
    step = np.where(TIME < 0.5, 8e4, 6e5)
    noisy = MeasuredSignal(TIME, step + 7e3 * rng.standard_normal(TIME.size), 7e3)
    smooth = smooth_pressure(noisy)
    near = np.abs(TIME - 0.5) < 6e-3
    assert np.array_equal(smooth[near], noisy.values[near])
    far = np.abs(TIME - 0.5) > 0.02
    assert np.std((smooth - step)[far]) < 0.45 * 7e3


def test_an_ideal_sensor_is_left_alone_where_it_bends() -> None:
    exact = MeasuredSignal(TIME, 3e6 * np.maximum(TIME - 0.3, 0.0), 1e-6)
    assert np.array_equal(smooth_pressure(exact)[295:306], exact.values[295:306])
    assert np.allclose(smooth_pressure(exact), exact.values, atol=1e-3)


def _flicker(values: FloatArray) -> float:
    """Share of the samples at which an element closed in the mean would be open."""
    return float(np.mean(values[TIME < 0.45] < P0))


def test_about_p0_a_steady_pressure_does_not_flicker_with_its_noise() -> None:
    rng = np.random.default_rng(6)
    held = np.where(TIME < 0.5, P0 + 5e3, 6e5)
    noisy = MeasuredSignal(TIME, held + 7e3 * rng.standard_normal(TIME.size), 7e3)
    assert _flicker(smooth_pressure(noisy)) > 0.02
    smooth = smooth_pressure(noisy, PriorValue(P0, 5e3))
    assert _flicker(smooth) < 0.003
    assert np.std((smooth - held)[TIME < 0.45]) < 0.2 * 7e3
    assert np.array_equal(smooth[TIME > 0.55], smooth_pressure(noisy)[TIME > 0.55])


def test_about_p0_a_pressure_that_moves_keeps_its_motion() -> None:
    rng = np.random.default_rng(7)
    falling = P0 + 2e5 * (0.5 - TIME) + 2e4 * np.sin(2.0 * np.pi * 15.0 * TIME)
    noisy = MeasuredSignal(TIME, falling + 2e3 * rng.standard_normal(TIME.size), 2e3)
    smooth = smooth_pressure(noisy, PriorValue(P0, 5e3))
    assert np.sqrt(np.mean((smooth - falling) ** 2)) < 0.5 * 2e3
