# SPDX-License-Identifier: MIT
"""Monotone curves: nearest in the metric of the covariance, by conditions of optimality."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.identify.shape.fit import shaped
from drivetwin.identify.shape.kind import Shape


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 8), st.sampled_from([Shape.FALLING, Shape.RISING]))
def test_is_monotone_and_no_neighbour_is_nearer(seed: int, size: int, shape: Shape) -> None:
    rng = np.random.default_rng(seed)
    factor = rng.standard_normal((size, size)) + 2.0 * np.eye(size)
    covariance = factor @ factor.T
    free = rng.standard_normal(size)
    mu, within = shaped(shape, free, covariance)
    steps = np.diff(mu) if shape is Shape.RISING else -np.diff(mu)
    assert steps.min() > -1e-8
    inverse = np.linalg.inv(covariance)

    def distance(x: np.typing.NDArray[np.float64]) -> float:
        return float((x - free) @ inverse @ (x - free))

    best = distance(mu)
    for _ in range(20):
        other = np.sort(mu + 0.1 * rng.standard_normal(size))
        other = other if shape is Shape.RISING else other[::-1]
        assert distance(other) > best - 1e-7
    assert np.all(np.linalg.eigvalsh(covariance - within) > -1e-7 * np.trace(covariance))


def test_a_curve_of_that_shape_stays_as_it_is() -> None:
    mu, covariance = np.array([0.14, 0.12, 0.11]), 1e-6 * np.eye(3)
    for shape in (Shape.FREE, Shape.FALLING):
        told, within = shaped(shape, mu, covariance)
        assert told == pytest.approx(mu, abs=1e-9)
        assert within == pytest.approx(covariance, abs=1e-12)
