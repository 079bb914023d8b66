# SPDX-License-Identifier: MIT
"""Known values brought into a linear estimate and taken out: conditional normal distributions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.estimation.result.prior_conflict import add_priors, remove_prior
from drivetwin.vehicle.spec import PriorValue

IDS = ("eta", "k_o", "c_o")
VALUES = np.array([0.9, 1.5e5, 300.0])
_ROOT = np.array([[1e-3, 0.0, 0.0], [400.0, 300.0, 0.0], [1.0, -2.0, 2.0]])
COVARIANCE = _ROOT @ _ROOT.T


def test_a_fixed_value_comes_back_and_the_others_follow_their_regression() -> None:
    values, covariance, warnings = add_priors(IDS, VALUES, COVARIANCE, {"k_o": PriorValue(1.503e5)})
    assert values[1] == pytest.approx(1.503e5, rel=1e-14)
    assert covariance[1] == pytest.approx(0.0, abs=1e-6)
    slope = COVARIANCE[0, 1] / COVARIANCE[1, 1]
    assert values[0] == pytest.approx(0.9 + 300.0 * slope)
    assert covariance[0, 0] == pytest.approx(COVARIANCE[0, 0] - slope * COVARIANCE[0, 1])
    assert warnings == ()


@given(value=st.floats(1e5, 2e5), std=st.floats(1.0, 1e4))
def test_a_prior_weighs_by_its_precision(value: float, std: float) -> None:
    values, covariance, _ = add_priors(IDS, VALUES, COVARIANCE, {"k_o": PriorValue(value, std)})
    weight = 1.0 / COVARIANCE[1, 1] + 1.0 / std**2
    mean = (VALUES[1] / COVARIANCE[1, 1] + value / std**2) / weight
    assert values[1] == pytest.approx(mean, rel=1e-9)
    assert covariance[1, 1] == pytest.approx(1.0 / weight, rel=1e-6)


def test_what_the_log_contradicts_is_told() -> None:
    _, _, warnings = add_priors(IDS, VALUES, COVARIANCE, {"eta": PriorValue(0.8)})
    assert len(warnings) == 1
    assert warnings[0].subject == "eta"
    _, _, warnings = add_priors(IDS, VALUES, COVARIANCE, {"eta": PriorValue(0.9035)})
    assert len(warnings) == 1


@given(
    st.floats(0.05, 0.2), st.floats(5e4, 1.2e5), st.floats(-0.9, 0.9),
    st.floats(1e3, 6e4), st.floats(2e4, 1e6),
)  # fmt: skip
def test_taking_a_prior_out_gives_back_what_the_log_alone_says(
    mu: float, P0: float, correlation: float, std: float, prior_std: float
) -> None:
    own = np.array([mu, P0])
    stds = np.array([1e-3, std])
    covariance = np.outer(stds, stds) * np.array([[1.0, correlation], [correlation, 1.0]])
    prior = PriorValue(8e4, prior_std)
    information = np.linalg.inv(covariance)
    pull = information @ own
    information[1, 1] += prior.std**-2
    pull[1] += prior.value * prior.std**-2
    posterior = np.linalg.inv(information)
    freed = remove_prior(posterior @ pull, posterior, 1, prior)
    assert freed is not None
    values, spread = freed
    assert values == pytest.approx(own, rel=1e-6)
    scale = np.outer(stds, stds)  # small correlations cancel: entries compare on this scale
    assert spread / scale == pytest.approx(covariance / scale, abs=1e-5)


@pytest.mark.parametrize(
    ("std", "variance"),
    [(0.0, 1e6), (1e4, 0.995e8), (1e4, np.nan), (1e4, 0.0)],
    ids=["known exactly", "all from the card", "no covariance", "no uncertainty"],
)
def test_where_the_log_says_nothing_nothing_is_given_back(std: float, variance: float) -> None:
    covariance = np.array([[1e-6, 0.0], [0.0, variance]])
    assert remove_prior(np.array([0.1, 8e4]), covariance, 1, PriorValue(8e4, std)) is None
