# SPDX-License-Identifier: MIT
"""Errors in variables: no attenuation, true intervals, refusal of undetermined directions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array, identity

from drivetwin.errors import IdentificationError
from drivetwin.estimation.regression.errors_in_variables import (
    BandedCholesky,
    Fit,
    Term,
    solve,
)
from drivetwin.estimation.regression.modulating_functions import Quadrature
from drivetwin.likelihood.point import Prior
from tests.support.arrays import FloatArray
from tests.support.coverage import assert_covers, vary_draws

N = 120
ONE = np.ones(N)


def line(x: FloatArray, y: FloatArray, sigma: float, prior: Prior | None = None) -> Fit:
    """Fit y = θ·x, both measured with noise `sigma`."""
    unit = Quadrature(csr_array(identity(N)))

    def terms(theta: FloatArray) -> list[Term]:
        return [
            Term(y, sigma, unit, ONE, {}),
            Term(x, sigma, unit, -theta[0] * ONE, {0: (-ONE, unit)}),
        ]

    return solve(terms, np.array([1.0]), prior or Prior.from_independent(1, {}))


@vary_draws(short=True)
def test_noise_in_the_regressor_neither_biases_nor_narrows_the_interval(draws: int) -> None:
    truth, sigma = 2.0, 0.5
    x = np.linspace(-1.0, 1.0, N)
    inside, estimates, plain = 0, [], []
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        xn = x + sigma * rng.standard_normal(N)
        yn = truth * x + sigma * rng.standard_normal(N)
        fit = line(xn, yn, sigma)
        estimates.append(fit.theta[0])
        plain.append(float(xn @ yn / (xn @ xn)))
        inside += abs(fit.theta[0] - truth) < 1.96 * fit.std[0]
    error = np.mean(estimates) - truth
    assert np.mean(plain) < 0.7 * truth
    assert abs(error) < 3.5 * np.std(estimates) / np.sqrt(draws) + 0.02
    assert_covers(inside, draws)


def test_exact_data_give_the_exact_value() -> None:
    x = np.linspace(1.0, 2.0, N)
    assert line(x, 3.0 * x, 0.1).theta[0] == pytest.approx(3.0, rel=1e-9)


def test_prior_and_data_are_weighed_by_their_information() -> None:
    x = np.full(N, 1e-4)
    fit = line(x, 3.0 * x, 0.1, Prior.from_independent(1, {0: (5.0, 0.2)}))
    assert fit.theta[0] == pytest.approx(5.0, abs=0.01)
    assert fit.std[0] == pytest.approx(0.2, rel=0.05)


def test_a_direction_without_information_is_refused() -> None:
    with pytest.raises(IdentificationError, match="does not act"):
        line(np.zeros(N), np.zeros(N), 1e-6)


def test_where_no_part_of_a_step_helps_the_search_stays_where_it_is() -> None:
    """y + θ² has its least value at 0, and near there steps that aim at -y/(2θ), far beyond."""
    unit = Quadrature(csr_array(identity(N)))

    def terms(theta: FloatArray) -> list[Term]:
        return [
            Term(ONE, 1.0, unit, ONE, {}),
            Term(ONE, 0.0, unit, theta[0] ** 2 * ONE, {0: (2.0 * theta[0] * ONE, unit)}),
        ]

    fit = solve(terms, np.array([1e-3]), Prior.from_independent(1, {}))
    assert fit.theta[0] == 1e-3
    assert fit.residual == pytest.approx(1.0 + fit.theta[0] ** 2)
    assert fit.q == pytest.approx(N * (1.0 + fit.theta[0] ** 2) ** 2)


def test_banded_factor_solves_as_the_dense_one() -> None:
    rng = np.random.default_rng(0)
    a = np.tril(np.triu(rng.standard_normal((30, 30)), -3))
    cov = a @ a.T + 30.0 * np.eye(30)
    factor = BandedCholesky.from_covariance(cov)
    x = rng.standard_normal(30)
    assert factor.solve(x) == pytest.approx(np.linalg.solve(cov, x))
    white = factor.whiten(x)
    assert white @ white == pytest.approx(x @ np.linalg.solve(cov, x))
