# SPDX-License-Identifier: MIT
"""Noise and unseen torques told apart by what a fit leaves, and the covariance they make."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.estimation.linear.ringdown import (
    FitResidual,
    compute_forced_response,
    compute_hat_weights,
    estimate_slope_covariance,
    estimate_variances,
    place_knots,
)
from tests.support.arrays import FloatArray

TIME = np.arange(0.0, 1.6, 2e-3)
RATE, OMEGA = 4.5, 75.0
SIGMA = 30.0
KNOTS = place_knots(TIME, OMEGA)
RESPONSE = compute_forced_response(RATE, OMEGA, TIME, compute_hat_weights(TIME, KNOTS))
SLOPES = (
    np.column_stack([np.cos(OMEGA * TIME), np.sin(OMEGA * TIME)]) * np.exp(-RATE * TIME)[:, None]
)


def left_of(seed: int, torque: float) -> FitResidual:
    """What a fit of two amplitudes leaves of noise and of torques of a standard deviation [N m]."""
    random = np.random.default_rng(seed)
    acting = torque * random.standard_normal(KNOTS.size)
    values = RESPONSE @ acting + SIGMA * random.standard_normal(TIME.size)
    q, _ = np.linalg.qr(SLOPES)
    residual = values - q @ (q.T @ values)
    return FitResidual(residual, SLOPES, SIGMA / 10.0, RESPONSE, np.zeros(KNOTS.size))


def told(torque: float, seeds: int = 20) -> tuple[FloatArray, FloatArray]:
    """Standard deviations told of noise and of torque (seeds,) [N m]."""
    found = [estimate_variances(left_of(seed, torque)) for seed in range(seeds)]
    noise = np.array([noise for noise, _ in found])
    return np.sqrt(noise), np.sqrt([float(np.mean(acting)) for _, acting in found])


def test_noise_and_torque_are_told_apart() -> None:
    noise, torque = told(60.0)
    assert np.mean(noise) == pytest.approx(SIGMA, rel=0.02)
    assert np.mean(torque) == pytest.approx(60.0, rel=0.1)
    noise, torque = told(0.0)
    assert np.mean(noise) == pytest.approx(SIGMA, rel=0.02)
    assert np.max(torque) < 10.0


def test_with_noise_alone_the_covariance_is_hardly_more_than_that_of_least_squares() -> None:
    """A seventh more of a standard deviation is the price of not knowing that there is no more."""
    plain = SIGMA**2 * np.linalg.inv(SLOPES.T @ SLOPES)
    found = np.array([estimate_slope_covariance(left_of(seed, 0.0), SLOPES) for seed in range(20)])
    ratios = np.diagonal(found, axis1=1, axis2=2) / np.diag(plain)
    assert np.all(ratios > 0.95)
    assert np.all(np.mean(ratios, axis=0) < 1.45)


def test_intervals_cover_what_unseen_torques_do() -> None:
    """Amplitudes fitted to torques alone scatter as told; by white noise they would not."""
    random = np.random.default_rng(5)
    scatter = np.linalg.pinv(SLOPES) @ RESPONSE @ random.normal(0.0, 60.0, (KNOTS.size, 4000))
    true = np.cov(scatter) + SIGMA**2 * np.linalg.inv(SLOPES.T @ SLOPES)
    found = np.mean(
        [estimate_slope_covariance(left_of(seed, 60.0), SLOPES) for seed in range(20)], axis=0
    )
    assert np.diag(found) == pytest.approx(np.diag(true), rel=0.2)
    residual = left_of(0, 60.0).residual
    white = np.mean(residual**2) * np.linalg.inv(SLOPES.T @ SLOPES)
    assert np.all(np.diag(white) < 0.6 * np.diag(true))


def test_what_is_known_to_be_unknown_counts_where_nothing_shows_it() -> None:
    calm = left_of(1, 0.0)
    jittering = replace(calm, known=np.full(KNOTS.size, 60.0**2))
    assert np.all(
        np.diag(estimate_slope_covariance(jittering, SLOPES))
        > 2.0 * np.diag(estimate_slope_covariance(calm, SLOPES))
    )


@given(st.floats(0.0, 1e9), st.floats(0.0, 1e6), st.floats(0.0, 1e6))
def test_any_power_of_anything_gives_finite_variances(
    shown: float, sigma: float, known: float
) -> None:
    left = left_of(2, 0.0)
    noise, torque = estimate_variances(
        replace(left, residual=shown * left.residual, sigma=sigma, known=left.known + known**2)
    )
    assert np.isfinite(noise)
    assert noise >= sigma**2 * (1.0 - 1e-12)
    assert np.all(np.isfinite(torque))
    assert np.all(torque >= known**2 * (1.0 - 1e-12))
