# SPDX-License-Identifier: MIT
"""Known values brought into a linear estimate: conditional normal distributions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.identify.known import with_known
from drivetwin.vehicle.spec import PriorValue

IDS = ("eta", "k_o", "c_o")
VALUES = np.array([0.9, 1.5e5, 300.0])
_ROOT = np.array([[1e-3, 0.0, 0.0], [400.0, 300.0, 0.0], [1.0, -2.0, 2.0]])
COVARIANCE = _ROOT @ _ROOT.T


def test_a_fixed_value_comes_back_and_the_others_follow_their_regression() -> None:
    values, covariance, warnings = with_known(IDS, VALUES, COVARIANCE, {"k_o": PriorValue(1.503e5)})
    assert values[1] == pytest.approx(1.503e5, rel=1e-14)
    assert covariance[1] == pytest.approx(0.0, abs=1e-6)
    slope = COVARIANCE[0, 1] / COVARIANCE[1, 1]
    assert values[0] == pytest.approx(0.9 + 300.0 * slope)
    assert covariance[0, 0] == pytest.approx(COVARIANCE[0, 0] - slope * COVARIANCE[0, 1])
    assert warnings == ()


@given(value=st.floats(1e5, 2e5), std=st.floats(1.0, 1e4))
def test_a_prior_weighs_by_its_precision(value: float, std: float) -> None:
    values, covariance, _ = with_known(IDS, VALUES, COVARIANCE, {"k_o": PriorValue(value, std)})
    weight = 1.0 / COVARIANCE[1, 1] + 1.0 / std**2
    mean = (VALUES[1] / COVARIANCE[1, 1] + value / std**2) / weight
    assert values[1] == pytest.approx(mean, rel=1e-9)
    assert covariance[1, 1] == pytest.approx(1.0 / weight, rel=1e-6)


def test_what_the_log_contradicts_is_told() -> None:
    _, _, warnings = with_known(IDS, VALUES, COVARIANCE, {"eta": PriorValue(0.8)})
    assert len(warnings) == 1
    assert "eta" in warnings[0]


def test_a_value_of_something_else_changes_nothing() -> None:
    values, covariance, _ = with_known(IDS, VALUES, COVARIANCE, {"J_out": PriorValue(1.0)})
    assert np.array_equal(values, VALUES)
    assert np.array_equal(covariance, COVARIANCE)
