# SPDX-License-Identifier: MIT
"""Mean and covariance of the unknowns by adaptive Metropolis sampling.

For records that determine the unknowns only together with their priors, whose distribution is cut
by bounds, so that no linearisation describes it. Source: H. Haario, E. Saksman and J. Tamminen,
An adaptive Metropolis algorithm, Bernoulli 7, 2001.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.actuator.search import Fit, Residuals, compute_inflation


@dataclass(frozen=True)
class SamplingSettings:
    """Length and step of the chain."""

    samples: int = 4000
    """Number of samples that count."""
    burn_in: int = 1000
    """Number of samples before them."""
    update: int = 200
    """Number of samples after which the proposals are adapted."""
    step: float = 2.38
    """Standard deviation of a proposal times √k over that of the samples (k unknowns)."""
    start: float = 0.05
    """Standard deviation of the first proposals over the usual size of an unknown."""
    seed: int = 1
    """Seed of the random numbers."""


SAMPLING = SamplingSettings()


def sample_posterior(residuals: Residuals, start: FloatArray) -> Fit:
    """Sample the unknowns from the values `start` (k,) of the least squares on.

    The residuals count as white with a variance of 1, or with theirs where it is larger, widened by
    their autocorrelation.
    """
    known, left = residuals.unknowns, residuals.compute(start)
    freedom = max(left.size - start.size - residuals.linear, 1)
    rms = float(np.sqrt(left @ left / freedom))
    variance = max(1.0, rms**2) * compute_inflation(left)

    def evaluate(values: FloatArray) -> float:
        if (values < known.lower).any() or (values > known.upper).any():
            return -np.inf
        deviation = (values - known.mean) / known.std
        cost = np.square(residuals.compute(values)).sum() / variance + np.square(deviation).sum()
        return -0.5 * float(cost)

    random = np.random.default_rng(SAMPLING.seed)
    size = start.size
    chain = np.empty((SAMPLING.burn_in + SAMPLING.samples, size))
    factor = np.diag(SAMPLING.start * known.size)
    now = np.clip(start, known.lower, known.upper)
    level = evaluate(now)
    for k in range(chain.shape[0]):
        if k and k % SAMPLING.update == 0:
            recent = np.cov(chain[k // 2 : k].T / known.size[:, None]) + 1e-8 * np.eye(size)
            root = np.linalg.cholesky(recent) * SAMPLING.step / np.sqrt(size)
            factor = known.size[:, None] * root
        proposed = now + factor @ random.standard_normal(size)
        height = evaluate(proposed)
        if np.log(random.random()) < height - level:
            now, level = proposed, height
        chain[k] = now
    counted = chain[SAMPLING.burn_in :]
    return Fit(counted.mean(axis=0), np.cov(counted.T), rms, left.size)
