# SPDX-License-Identifier: MIT
"""Friction laws as values with a covariance: μ_c, μ_s - μ_c, μ_v and ln v_s."""

from __future__ import annotations

import numpy as np

from drivetwin._util.arrays import FloatArray, propagate_variance
from drivetwin.estimation.direct.friction_law import build_law_derivatives
from drivetwin.estimation.result.estimate import Z95, FrictionCurve
from drivetwin.simulation.dual_clutch import Stribeck
from drivetwin.vehicle.spec import PARTNER_REST_STD


def to_values(law: Stribeck) -> FloatArray:
    """Return the values (4,) of a law."""
    return np.array([law.mu_c, law.mu_s - law.mu_c, law.mu_v, np.log(law.v_s)])


def to_law(values: FloatArray) -> Stribeck:
    """Return the law of values (4,)."""
    mu_c, drop, mu_v, ln_v_s = (float(one) for one in values)
    return Stribeck(mu_c, mu_c + drop, float(np.exp(ln_v_s)), mu_v)


def build_from_law(law: Stribeck) -> FloatArray:
    """Build the derivatives (4, 4) of the values by the fields of a law."""
    return np.asarray(np.linalg.inv(build_law_derivatives(law.v_s)), dtype=np.float64)


def compute_law_covariance(curve: FrictionCurve) -> FloatArray | None:
    """Compute the covariance (4, 4) of the values of a curve; None where it has none."""
    if curve.stribeck is None or curve.stribeck_covariance is None:
        return None
    rows = build_from_law(curve.stribeck)
    return np.asarray(rows @ curve.stribeck_covariance @ rows.T)


def compute_friction_std(curve: FrictionCurve | None) -> float:
    """Relative standard deviation of μ times gain in the middle of its curve; 0 without one.

    That of the gain alone is left out: the motion depends on the product.
    """
    if curve is None:
        return 0.0
    curve = curve.drop_gain_spread()
    half = 0.5 * (curve.mu_hi - curve.mu_lo) / np.abs(curve.mu)
    half = half[np.isfinite(half)]
    return float(np.median(half)) / Z95 if half.size else 0.0


def compute_scale_std(curve: FrictionCurve | None) -> float:
    """Relative standard deviation of μ times gain beside the covariance of its law."""
    whole = compute_friction_std(curve)
    covariance = None if curve is None else compute_law_covariance(curve)
    if curve is None or curve.stribeck is None or covariance is None:
        return whole
    slopes = curve.stribeck.compute_slopes(curve.slip)
    variance = propagate_variance(slopes.T, covariance) / curve.mu**2
    return float(np.sqrt(max(whole**2 - float(np.median(variance)), 0.0)))


def build_partner_spread(law: Stribeck, level: float) -> FloatArray:
    """Build the covariance (4, 4) by which the values of an element's law depart from those of its
    partner's `law`, where the log does not determine them; `level` is the standard deviation of
    their ratio [-]."""
    scaled = to_values(law) * np.array([1.0, 1.0, 1.0, 0.0])
    rest = np.array([0.0, PARTNER_REST_STD, 0.0, 0.0])
    return level**2 * np.outer(scaled, scaled) + np.outer(rest, rest)
