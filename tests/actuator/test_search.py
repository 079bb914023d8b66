# SPDX-License-Identifier: MIT
"""Sampling of unknowns against closed forms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from drivetwin.actuator.search import Unknowns, sample_posterior
from tests.support.arrays import FloatArray

RANDOM = np.random.default_rng(3)
COLUMNS = RANDOM.standard_normal((200, 2)) * [1.0, 0.05]


@dataclass(frozen=True, eq=False)
class Line:
    """Two unknowns in a linear regression with noise 1: one by the data, one by its prior."""

    unknowns: Unknowns
    target: FloatArray
    linear: int = 0
    noise: float = 1.0

    def compute(self, values: FloatArray) -> FloatArray:
        return self.target - COLUMNS @ values


def make_line(lower: float) -> Line:
    target = COLUMNS @ np.array([2.0, 1.0]) + RANDOM.standard_normal(200)
    bounds = np.array([-10.0, lower]), np.array([10.0, 10.0])
    return Line(Unknowns(np.ones(2), *bounds, np.zeros(2), np.array([np.inf, 0.5])), target)


def test_a_gaussian_posterior_has_its_mean_and_covariance() -> None:
    line = make_line(-10.0)
    information = COLUMNS.T @ COLUMNS + np.diag([0.0, 4.0])
    covariance = np.linalg.inv(information)
    mean = covariance @ COLUMNS.T @ line.target
    found = sample_posterior(line, mean)
    std = np.sqrt(np.diag(covariance))
    assert found.values == pytest.approx(mean, abs=0.2 * std.max())
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx(std, rel=0.25)


def test_samples_stay_within_the_bounds() -> None:
    found = sample_posterior(make_line(0.0), np.array([2.0, 0.1]))
    assert found.values[1] > 0.0
    assert np.sqrt(found.covariance[1, 1]) < 0.5
