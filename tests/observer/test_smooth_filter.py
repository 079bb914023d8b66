# SPDX-License-Identifier: MIT
"""The smoother against the same problem solved as one joint Gaussian."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.observer.smooth import Measurement, Process, filter_forward, smooth_states
from tests.support.arrays import FloatArray


def _process(seed: int, size: int, count: int) -> Process:
    """A random process; its last state is a constant without noise, as parameters are."""
    rng = np.random.default_rng(seed)
    transition = np.eye(size) + 0.3 * rng.standard_normal((count - 1, size, size))
    transition[:, -1, :] = np.eye(size)[-1]
    push = rng.standard_normal((count - 1, size))
    push[:, -1] = 0.0
    noise = rng.uniform(0.1, 1.0, (count - 1, size))
    noise[:, -1] = 0.0
    factor = rng.standard_normal((size, size))
    measurements: list[list[Measurement]] = [
        [
            (rng.standard_normal(size), float(rng.standard_normal()), float(rng.uniform(0.1, 2)))
            for _ in range(rng.integers(0, 3))
        ]
        for _ in range(count)
    ]
    mean = rng.standard_normal(size)
    return Process(transition, push, noise, mean, factor @ factor.T, measurements)


def _joint(process: Process) -> tuple[FloatArray, FloatArray, float]:
    """Mean (N·n,), covariance given all measurements, and -2·log-likelihood, by conditioning."""
    count, size = len(process.measurements), process.mean.size
    mean = [process.mean]
    blocks = np.zeros((count, count, size, size))
    blocks[0, 0] = process.covariance
    for k, (F, b, q) in enumerate(
        zip(process.transition, process.push, process.noise, strict=True), start=1
    ):
        mean.append(F @ mean[-1] + b)
        for j in range(k):
            blocks[k, j] = F @ blocks[k - 1, j]
            blocks[j, k] = blocks[k, j].T
        blocks[k, k] = F @ blocks[k - 1, k - 1] @ F.T + np.diag(q)
    x = np.concatenate(mean)
    P = blocks.transpose(0, 2, 1, 3).reshape(count * size, count * size)
    rows, values, variances = [], [], []
    for k, taken in enumerate(process.measurements):
        for row, value, variance in taken:
            whole = np.zeros(count * size)
            whole[k * size : (k + 1) * size] = row
            rows.append(whole)
            values.append(value)
            variances.append(variance)
    if not rows:
        return x, P, 0.0
    H = np.array(rows)
    S = H @ P @ H.T + np.diag(variances)
    miss = np.array(values) - H @ x
    gain = P @ H.T @ np.linalg.inv(S)
    surprise = float(miss @ np.linalg.solve(S, miss) + np.linalg.slogdet(S)[1])
    return x + gain @ miss, P - gain @ H @ P, surprise


@settings(max_examples=25)
@given(st.integers(0, 10_000), st.integers(1, 4), st.integers(2, 7))
def test_equals_the_joint_gaussian(seed: int, size: int, count: int) -> None:
    process = _process(seed, size, count)
    means, covariances = smooth_states(process)
    mean, covariance, surprise = _joint(process)
    scale = 1.0 + float(np.abs(covariance).max())
    assert means.ravel() == pytest.approx(mean, abs=1e-8 * scale * (1 + np.abs(mean).max()))
    for k in range(count):
        part = slice(k * size, (k + 1) * size)
        assert covariances[k] == pytest.approx(covariance[part, part], abs=1e-8 * scale)
    assert filter_forward(process).surprise == pytest.approx(surprise, rel=1e-8, abs=1e-6)


def test_a_locked_direction_stays_locked() -> None:
    """A measurement nearly without error makes the covariance singular; nothing breaks."""
    process = _process(3, 3, 5)
    row = np.array([1.0, -2.0, 0.0])
    taken = [list(one) for one in process.measurements]
    taken[2].append((row, 0.0, 1e-12))
    tight = Process(
        process.transition,
        process.push,
        process.noise,
        process.mean,
        process.covariance,
        taken,
    )
    means, covariances = smooth_states(tight)
    assert abs(row @ means[2]) < 1e-5
    assert 0.0 <= row @ covariances[2] @ row + 1e-9 < 1e-8
