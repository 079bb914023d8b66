# SPDX-License-Identifier: MIT
"""Friction of one vehicle's clutch as values that logged shifts correct."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.linear.friction_points import build_law_derivatives
from drivetwin.estimation.result.estimate import Z95, FrictionCurve
from drivetwin.twin.friction_law import (
    build_partner_spread,
    compute_friction_std,
    compute_law_covariance,
    to_law,
    to_values,
)
from drivetwin.vehicle.distribution import PARTNER_LEVEL_STD


@dataclass(frozen=True, eq=False)
class FrictionUnknowns:
    """Values (k,) of the friction of an element, `mean` and `covariance` (k, k) before the logs.

    They are μ_c, μ_s - μ_c, μ_v and ln v_s of the law of `curve`; one scale of it without a law.
    """

    element: str
    curve: FrictionCurve
    mean: FloatArray
    covariance: FloatArray

    def is_possible(self, values: FloatArray) -> bool:
        """Return whether values (k,) make a friction above zero at rest and in slip."""
        return bool(values[0] > 0.0 and (values.size == 1 or values[0] + values[1] > 0.0))

    def build_curve(self, values: FloatArray, covariance: FloatArray, method: str) -> FrictionCurve:
        """Build the curve of values (k,) with their covariance (k, k)."""
        curve, law, law_covariance = self.curve, None, None
        if curve.stribeck is None:
            scale, slopes = values[0] * np.ones_like(curve.mu), curve.mu[None]
        else:
            law = to_law(values)
            scale = law.evaluate(curve.slip) / curve.stribeck.evaluate(curve.slip)
            slopes = law.compute_slopes(curve.slip)
            back = build_law_derivatives(law.v_s)
            law_covariance = back @ covariance @ back.T
        half = Z95 * np.sqrt(np.einsum("pn,pq,qn->n", slopes, covariance, slopes))
        mu = scale * curve.mu
        place = np.interp(curve.points_slip, curve.slip, scale)
        return replace(
            curve,
            mu=mu,
            mu_lo=mu - half,
            mu_hi=mu + half,
            points_mu=place * curve.points_mu,
            stribeck=law,
            stribeck_covariance=law_covariance,
            method=method,
        )


def build_friction_unknowns(
    element: str, partner: str, curves: Mapping[str, FrictionCurve], gain: float
) -> FrictionUnknowns:
    """Build the friction of an element of a made unit, whose gain has the spread `gain`.

    An element without a curve has that of its partner, from which it departs as in an
    identification of a clutch that only disengages.
    """
    own = curves.get(element)
    curve = curves[partner] if own is None else own
    law, known = curve.stribeck, None if own is None else compute_law_covariance(own)
    mean = np.ones(1) if law is None else to_values(law)
    scaled = np.ones(1) if law is None else mean * np.array([1.0, 1.0, 1.0, 0.0])
    if own is None:
        covariance = _build_other_clutch(curve)
    elif known is not None:
        covariance = known
    else:
        covariance = compute_friction_std(curve) ** 2 * np.outer(scaled, scaled)
    return FrictionUnknowns(element, curve, mean, covariance + gain**2 * np.outer(scaled, scaled))


def _build_other_clutch(curve: FrictionCurve) -> FloatArray:
    """Covariance (k, k) of the friction of a clutch about that of another one."""
    if curve.stribeck is None:
        return np.array([[PARTNER_LEVEL_STD**2]])
    return build_partner_spread(curve.stribeck)
