# SPDX-License-Identifier: MIT
"""Joint step and evidence against a dense linear Gaussian model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from drivetwin.estimation.likelihood.effects.columns import EffectColumns
from drivetwin.estimation.likelihood.effects.joint_step import (
    SIZES,
    JointStep,
    WeightedColumns,
    compute_evidence,
    compute_size_spread,
    scale_by_evidence,
)
from drivetwin.estimation.result.cause import Group
from drivetwin.vehicle.effects import EffectId
from tests.support.arrays import FloatArray

DRAG, DRIFT = Group(EffectId.INPUT_DRAG), Group(EffectId.OUTPUT_TORQUE_DRIFT)
SENSOR = Group(None, "output_torque offset")


class Dense:
    """n samples of unit variance with slopes J (n, p) and columns Z (n, q) of three groups."""

    def __init__(self, seed: int, amounts: FloatArray | None = None) -> None:
        rng = np.random.default_rng(seed)
        self.J, self.Z = rng.standard_normal((60, 3)), 0.3 * rng.standard_normal((60, 5))
        self.prior = np.diag([4.0, 1.0, 0.5])
        acting = np.zeros(5) if amounts is None else amounts
        self.y = self.J @ rng.standard_normal(3) * 0.3 + self.Z @ acting + rng.standard_normal(60)
        self.groups = (DRAG, DRAG, DRIFT, DRIFT, SENSOR)

    @property
    def sums(self) -> WeightedColumns:
        none = EffectColumns(self.groups, (self.Z,), (np.zeros(60),), np.ones(5), ({},))
        return WeightedColumns(
            none, self.Z.T @ self.Z, self.J.T @ self.Z, self.Z.T @ self.y, -self.J.T @ self.y, ()
        )

    @property
    def information(self) -> FloatArray:
        return np.asarray(self.J.T @ self.J + self.prior)

    def log_likelihood(self, columns: list[int]) -> float:
        """Marginal likelihood of the samples with some columns acting."""
        Z = self.Z[:, columns]
        covariance = np.eye(60) + self.J @ np.linalg.inv(self.prior) @ self.J.T + Z @ Z.T
        return float(multivariate_normal(np.zeros(60), covariance).logpdf(self.y))


@pytest.mark.parametrize("seed", range(3))
def test_evidence_is_the_ratio_of_marginal_likelihoods(seed: int) -> None:
    """Stated tolerances of sensors act in both models."""
    made = Dense(seed)
    found = compute_evidence(made.sums, made.information, 1.0)
    for group, columns in ((DRAG, [0, 1]), (DRIFT, [2, 3])):
        expected = made.log_likelihood([*columns, 4]) - made.log_likelihood([4])
        assert found[group].nats == pytest.approx(expected, abs=1e-9)


def test_an_error_of_a_sensor_within_its_tolerance_is_no_evidence_for_an_effect() -> None:
    made = Dense(0, np.array([0.0, 0.0, 0.0, 0.0, 4.0]))
    found = compute_evidence(made.sums, made.information, 1.0)
    expected = made.log_likelihood([4]) - made.log_likelihood([])
    assert found[SENSOR].nats == pytest.approx(expected, abs=1e-9)
    assert found[DRAG].nats < 3.0


def test_sizes_are_those_of_greatest_evidence() -> None:
    made = Dense(1, np.array([9.0, -9.0, 0.0, 0.0, 0.0]))
    sums = replace(made.sums, weighted=(made.Z,))
    scaled, sizes = scale_by_evidence(sums, made.information, 1.0)
    scale = scaled.columns.scale
    assert np.exp([sizes[DRAG], sizes[DRIFT]]) == pytest.approx(scale[[0, 2]])
    assert scale[0] == scale[1] > 1.5
    assert scale[2] == scale[3] < 1.0
    assert scale[4] == 1.0

    def compute_posterior(sizes: FloatArray) -> float:
        """Log density of y with the unknowns and amounts integrated out, and of the sizes."""
        shape = (made.Z * sizes) @ (made.Z * sizes).T
        covariance = np.eye(60) + made.J @ np.linalg.inv(made.prior) @ made.J.T + shape
        logs = np.log(sizes[[0, 2]]) / SIZES.spread
        nats = multivariate_normal(np.zeros(60), covariance).logpdf(made.y)
        return float(nats) - 0.5 * float(logs @ logs)

    best = compute_posterior(scale)
    for group in (slice(0, 2), slice(2, 4)):
        for factor in (0.2, 0.9, 0.99, 1.01, 1.1, 5.0):
            other = scale.copy()
            other[group] *= factor
            assert compute_posterior(other) < best


def test_estimates_vary_with_the_sizes_by_their_posterior() -> None:
    """Each size is another model; all are solved and their evidence is computed densely."""
    made = Dense(2, np.array([2.0, -1.0, 0.0, 0.0, 0.0]))

    def solve(log: float) -> tuple[FloatArray, FloatArray, float]:
        """Return unknowns and amounts in the stated size, M⁻¹, and the log posterior of a size."""
        scale = np.where([one == DRAG for one in made.groups], np.exp(log), 1.0)
        Z = made.Z * scale
        cross = made.J.T @ Z
        inverse = np.linalg.inv(
            np.block([[made.information, cross], [cross.T, Z.T @ Z + np.eye(5)]])
        )
        answer = inverse @ np.concatenate([made.J.T @ made.y, Z.T @ made.y])
        answer[3:] *= scale
        noise = np.eye(60) + Z @ Z.T + made.J @ np.linalg.inv(made.prior) @ made.J.T
        nats = multivariate_normal(np.zeros(60), noise).logpdf(made.y)
        return answer, inverse, float(nats) - 0.5 * (log / SIZES.spread) ** 2

    found = [solve(one) for one in np.linspace(-SIZES.farthest, SIZES.farthest, SIZES.nodes)]
    weights = np.exp([nats - max(one[2] for one in found) for _, _, nats in found])
    weights /= weights.sum()
    apart = np.array([answer for answer, _, _ in found])
    apart -= weights @ apart
    expected = (weights * apart.T) @ apart

    for size in (0.0, 0.7):
        answer, inverse, _ = solve(size)
        scale = np.where([one == DRAG for one in made.groups], np.exp(size), 1.0)
        columns = made.sums.columns
        amounts = answer[3:] / scale
        step = JointStep(columns, answer[:3], amounts, inverse, np.zeros((8, 8)), 1.0, (), {})
        stated = np.append(np.ones(3), scale)
        spread = compute_size_spread(step, {DRAG: size}) * np.outer(stated, stated)
        np.testing.assert_allclose(spread, expected, rtol=1e-8, atol=1e-12)
        assert spread[0, 0] > 0.0
