# SPDX-License-Identifier: MIT
"""Noise and rounding of a signal, against what was put in."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import butter, sosfilt
from scipy.stats import norm

from drivetwin._util.arrays import estimate_rounding_step
from drivetwin.likelihood.measured_signal import (
    MeasuredSignal,
    estimate_noise,
    estimate_quantization_error,
    estimate_white_noise,
)
from tests.support.arrays import FloatArray

STEP = 12.5
"""Rounding step of an engine torque on a bus [N m]."""


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
    assert estimate_rounding_step(rounded) == pytest.approx(11.0)


def read_levels(rng: np.random.Generator, levels: FloatArray, noise: float) -> MeasuredSignal:
    """Read 100 samples at each level with `noise`, rounded to `STEP`."""
    true = np.repeat(levels, 100)
    values = STEP * np.round((true + noise * rng.standard_normal(true.size)) / STEP)
    time = np.linspace(0.0, 0.01 * true.size, true.size)
    return MeasuredSignal(time, values, float(np.hypot(noise, STEP / 3.46)))


def compute_mean_error(level: FloatArray, noise: float) -> FloatArray:
    """Compute the mean of what is read less the level, summed over the codes by SciPy's normal."""
    near = np.round(level / STEP)[:, None] + np.arange(-8, 9)
    edges = (near[:, :, None] + [-0.5, 0.5]) * STEP - level[:, None, None]
    chance = np.diff(norm.cdf(edges, scale=noise), axis=2)[:, :, 0]
    return np.asarray(np.sum(chance * near, axis=1) * STEP - level)


@pytest.mark.parametrize("share", [0.05, 0.15, 0.25, 0.35])
def test_the_error_of_drawn_levels_has_the_estimated_size(share: float) -> None:
    rng = np.random.default_rng(5)
    score = []
    for _ in range(40):
        levels = rng.uniform(600.0, 1900.0, 6)
        estimated = estimate_quantization_error(read_levels(rng, levels, share * STEP), STEP)
        score.append(compute_mean_error(levels, share * STEP) / estimated)
    assert 0.6 < np.sqrt(np.mean(np.square(score))) < 1.2


def test_without_noise_the_error_of_a_level_is_uniform() -> None:
    rng = np.random.default_rng(6)
    signal = read_levels(rng, rng.uniform(600.0, 1900.0, 12), 0.0)
    assert estimate_quantization_error(signal, STEP) == pytest.approx(STEP / np.sqrt(12.0), rel=0.1)


def test_levels_on_a_code_show_their_noise_where_differences_do_not() -> None:
    """Noise of 0.35 steps at levels that are codes: few samples leave their code, so that their
    differences seem to hold rounding alone, and yet the counts show the noise."""
    rng = np.random.default_rng(7)
    signal = read_levels(rng, STEP * np.arange(100.0, 112.0), 0.35 * STEP)
    assert estimate_quantization_error(signal, STEP) < 0.06 * STEP


@pytest.mark.parametrize("noise", [0.7 * STEP, 3.0 * STEP])
def test_noise_that_dithers_leaves_little(noise: float) -> None:
    rng = np.random.default_rng(8)
    signal = read_levels(rng, rng.uniform(600.0, 1900.0, 12), noise)
    assert estimate_quantization_error(signal, STEP) < 0.02 * STEP


def test_a_signal_that_rests_nowhere_has_no_mean_error() -> None:
    time = np.linspace(0.0, 3.0, 300)
    ramp = STEP * np.round(2000.0 * time / STEP)
    assert estimate_quantization_error(MeasuredSignal(time, ramp, 4.0), STEP) == 0.0
    assert estimate_quantization_error(MeasuredSignal(time, ramp, 4.0), 0.0) == 0.0


@pytest.mark.parametrize("corner", [60.0, 130.0, 250.0])
def test_noise_behind_a_filter_counts_with_its_power_at_low_frequencies(corner: float) -> None:
    """A low-pass of a telemetry, Hz: neighbouring samples hardly differ, slow errors stay."""
    rng, time = np.random.default_rng(1), np.arange(0.0, 8.0, 1e-3)
    white = rng.standard_normal(time.size)
    signal = 300.0 + 200.0 * np.tanh(4.0 * (time - 4.0))
    filtered = sosfilt(butter(2, corner, fs=1000.0, output="sos"), white)
    assert estimate_noise(time, signal + white) == pytest.approx(1.0, rel=0.05)
    assert estimate_white_noise(signal + filtered) < 0.5
    assert 0.35 < estimate_noise(time, signal + filtered) < 1.2


def test_a_signal_without_noise_has_none() -> None:
    time = np.arange(0.0, 4.0, 1e-3)
    swinging = 100.0 * np.sin(2.0 * np.pi * 12.0 * time)
    assert estimate_noise(time, swinging) == estimate_white_noise(swinging)
