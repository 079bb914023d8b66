# SPDX-License-Identifier: MIT
"""Hinge fits: exact without noise, and with noise an error that their sigma explains."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from drivetwin.shifts.changepoint import Hinge, Moving, fit_hinge

_TIME = np.arange(-0.06, 0.06, 1e-3)


def _curve(at: float, moving: Moving, powers: dict[int, float]) -> NDArray[np.float64]:
    x = np.clip(moving.value * (_TIME - at), 0.0, None)
    return np.asarray(0.2 + sum(a * x**p for p, a in powers.items()))


def _fitted(values: NDArray[np.float64], moving: Moving) -> Hinge:
    hinge = fit_hinge(_TIME, values, moving, (-0.03, 0.03), 1e-6)
    assert hinge is not None
    return hinge


@pytest.mark.parametrize(
    ("moving", "powers"),
    [
        (Moving.BEFORE, {1: 150.0}),
        (Moving.BEFORE, {1: 150.0, 2: 900.0}),
        (Moving.BEFORE, {1: 90.0, 2: -300.0, 3: 4e3}),
        (Moving.AFTER, {1: -80.0}),
        (Moving.AFTER, {2: -1500.0}),
        (Moving.AFTER, {2: 1500.0, 3: -6e3}),
    ],
)
def test_noise_free_hinge_is_exact(moving: Moving, powers: dict[int, float]) -> None:
    hinge = _fitted(_curve(0.00437, moving, powers), moving)
    assert hinge.time == pytest.approx(0.00437, abs=2e-5)


@pytest.mark.parametrize(
    ("moving", "powers"),
    [(Moving.BEFORE, {1: 150.0, 2: 900.0}), (Moving.AFTER, {2: -2500.0})],
)
def test_sigma_covers_the_spread(moving: Moving, powers: dict[int, float]) -> None:
    """Normalised errors of 100 noisy fits have a mean near 0 and no spread above 1.

    It is below 1 where the form of the onset is in doubt too: sigma then covers both forms.
    """
    rng = np.random.default_rng(1)
    clean = _curve(0.002, moving, powers)
    fits = [_fitted(clean + 0.1 * rng.normal(size=len(clean)), moving) for _ in range(100)]
    scores = np.array([(fit.time - 0.002) / fit.sigma for fit in fits])
    assert abs(scores.mean()) < 0.5
    assert 0.25 < scores.std() < 1.3
    assert np.median([fit.noise_moving for fit in fits]) == pytest.approx(0.1, rel=0.1)


def test_no_movement_gives_no_certainty() -> None:
    """White noise alone: no hinge, or one that is unsure over the search range."""
    noise = 0.1 * np.random.default_rng(2).normal(size=len(_TIME))
    hinge = fit_hinge(_TIME, noise, Moving.AFTER, (-0.03, 0.03), 1e-6)
    assert hinge is None or hinge.sigma > 5e-3


def test_curve_that_cannot_follow_shows() -> None:
    ripple = np.where(_TIME > 0.0, 2.0 * np.sin(2.0 * np.pi * 60.0 * _TIME), 0.0)
    hinge = _fitted(_curve(0.0, Moving.AFTER, {1: 100.0}) + ripple, Moving.AFTER)
    assert hinge.noise_moving > 0.5
    assert _fitted(_curve(0.0, Moving.AFTER, {1: 100.0}), Moving.AFTER).noise_moving < 0.05
