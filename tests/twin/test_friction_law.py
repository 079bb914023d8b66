# SPDX-License-Identifier: MIT
"""Draws of friction laws by their covariance, and the part of a band that is beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.estimation.result.estimate import Z95, FrictionCurve
from drivetwin.simulation.dual_clutch import Stribeck
from drivetwin.twin.friction_law import (
    build_from_law,
    compute_law_covariance,
    compute_scale_std,
    to_law,
    to_values,
)

LAW = Stribeck(0.12, 0.14, 9.0, 2e-4)
STDS = np.array([2e-3, 3e-3, 1e-5, 0.2])
"""Standard deviations of the values of the law."""


def make_curve(widened: float = 0.0) -> FrictionCurve:
    """Curve of the law; its band has a relative standard deviation `widened` beside the law's."""
    slip = np.linspace(5.0, 90.0, 40)
    mu, slopes = LAW.evaluate(slip), LAW.compute_slopes(slip)
    std = np.sqrt(np.einsum("pn,p,pn->n", slopes, STDS**2, slopes) + (widened * mu) ** 2)
    back = np.linalg.inv(build_from_law(LAW))
    covariance = back @ np.diag(STDS**2) @ back.T
    half = Z95 * std
    return FrictionCurve(
        slip, mu, mu - half, mu + half, slip, mu, LAW, "likelihood", stribeck_covariance=covariance
    )


def test_values_and_law_are_inverse() -> None:
    found = to_law(to_values(LAW))
    assert vars(found) == pytest.approx(vars(LAW), rel=1e-14)


def test_derivatives_of_the_values_are_those_of_differences() -> None:
    for place, name in enumerate(vars(LAW)):
        step = 1e-6 * getattr(LAW, name)
        moved = replace(LAW, **{name: getattr(LAW, name) + step})
        slope = (to_values(moved) - to_values(LAW)) / step
        np.testing.assert_allclose(build_from_law(LAW)[:, place], slope, rtol=1e-5, atol=1e-9)


def test_a_scale_is_drawn_for_the_rest_of_the_band_alone() -> None:
    assert compute_scale_std(make_curve()) == pytest.approx(0.0, abs=1e-6)
    assert compute_scale_std(make_curve(0.05)) == pytest.approx(0.05, rel=0.02)
    assert compute_scale_std(None) == 0.0


def test_a_curve_without_a_covariance_has_its_band_as_scale() -> None:
    curve = replace(make_curve(0.05), stribeck_covariance=None)
    assert compute_law_covariance(curve) is None
    assert compute_scale_std(curve) > 0.05
