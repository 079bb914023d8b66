# SPDX-License-Identifier: MIT
"""The Stribeck law fitted to the points that the paper's procedure reads."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.estimation.paper.pipeline import fit_stribeck_law
from drivetwin.simulation.dual_clutch import Stribeck

SLIP = np.array([16.1, 22.5, 31.9, 41.2, 47.1, 56.1, 64.9, 70.1, 77.2, 79.0])


def test_points_of_a_law_give_the_law() -> None:
    law = Stribeck(0.11, 0.16, 20.0, 1e-4)
    found = fit_stribeck_law(SLIP, law.evaluate(SLIP))
    np.testing.assert_allclose(found.evaluate(SLIP), law.evaluate(SLIP), atol=2e-5)
    assert found.v_s == pytest.approx(20.0, rel=0.06)


def test_few_scattered_points_give_a_law_that_a_clutch_can_have() -> None:
    """Without bounds these points, read from a log of a truck, ask for a mu_c below zero."""
    mu = np.array([0.113, 0.113, 0.1091, 0.111, 0.1085, 0.1117, 0.1102, 0.1143, 0.1113, 0.1166])
    found = fit_stribeck_law(SLIP, mu)
    assert found.mu_c >= 0.0
    assert found.mu_s >= 0.0
    np.testing.assert_allclose(found.evaluate(SLIP), mu, atol=0.004)
