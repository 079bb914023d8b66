# SPDX-License-Identifier: MIT
"""Priors taken out of an estimate: conditional normal distributions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.estimation.result.prior_conflict import remove_prior
from drivetwin.vehicle.spec import PriorValue


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
