# SPDX-License-Identifier: MIT
"""μ times gain in the middle of a curve, and the verdict that the curve takes from it."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.estimation.result.estimate import Z95, Estimate, FrictionCurve, Verdict
from drivetwin.estimation.result.verdict import (
    adopt_verdicts,
    compute_mu_gain,
    report_gains,
)
from drivetwin.findings import Code
from drivetwin.vehicle.spec import PriorValue

SLIP = np.linspace(10.0, 90.0, 5)


def make_curve(mu: float, gain: PriorValue, std: float = 1e-3) -> FrictionCurve:
    level, half, empty = np.full(5, mu), np.full(5, Z95 * std), np.empty(0)
    plain = FrictionCurve(SLIP, level, level - half, level + half, empty, empty, None, "likelihood")
    return plain.add_gain_spread(gain)


def test_the_gain_widens_friction_and_not_its_product_with_the_gain() -> None:
    curve = make_curve(0.12, PriorValue(5e-3, 1e-3))
    assert (curve.mu_hi - curve.mu)[2] / Z95 == pytest.approx(np.hypot(1e-3, 0.2 * 0.12))
    assert compute_mu_gain(curve) == pytest.approx((6e-4, 5e-6))


@pytest.mark.parametrize(
    ("mu", "suspect"), [(0.12, False), (0.093, False), (0.083, True), (0.168, True)]
)
def test_an_unusual_friction_names_the_gain(mu: float, suspect: bool) -> None:
    curve = make_curve(mu, PriorValue(5e-3))
    value, std = compute_mu_gain(curve)
    one = Estimate("mu_gain.K2", value, std, Verdict.IDENTIFIED, "likelihood")
    found = report_gains({"K2": curve}, {"mu_gain.K2": one})
    assert [each.code for each in found] == [Code.GAIN_SUSPECT] * suspect


def test_a_withdrawn_product_withdraws_and_widens_the_curve() -> None:
    curve = make_curve(0.12, PriorValue(5e-3))
    one = Estimate("mu_gain.K2", 6e-4, 5e-6, Verdict.WEAK, "likelihood", 2e-5, "a reason")
    judged = adopt_verdicts({"K2": curve}, {"mu_gain.K2": one})["K2"]
    assert (judged.verdict, judged.reason) == (Verdict.WEAK, "a reason")
    assert compute_mu_gain(judged)[1] == pytest.approx(np.hypot(5e-6, 2e-5))
