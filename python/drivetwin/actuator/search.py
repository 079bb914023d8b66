# SPDX-License-Identifier: MIT
"""Estimates of the parameters of an actuator: least squares, or samples of their distribution.

Least squares search from several starts. The residuals are linearised by differences at the
minimum; their noise is estimated from the fit, and the covariance is widened by their
autocorrelation. Source: G. A. F. Seber and C. J. Wild, Nonlinear Regression, sections 2.1 and 6.2.

Records that determine the unknowns only together with their priors have a distribution cut by
bounds, which no linearisation describes. Its mean and covariance come from adaptive Metropolis
sampling. Source: H. Haario, E. Saksman and J. Tamminen, An adaptive Metropolis algorithm,
Bernoulli 7, 2001.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Protocol

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.actuator.model import QUANTITIES


@dataclass(frozen=True)
class SearchSettings:
    """Starts and limits of a search."""

    dead_times: tuple[float, ...] = (0.005, 0.02, 0.05, 0.1)
    """Starting values of the dead time [s]."""
    lags: tuple[float, ...] = (0.01, 0.03, 0.1)
    """Starting values of both lags [s]."""
    kiss_shares: tuple[float, ...] = (0.35, 0.5, 0.7, 0.85, 1.0, 1.2, 1.5, 1.8, 2.2, 2.7, 3.3)
    """Starting values of the kiss pressure, over the one that is expected."""
    fill_times: tuple[float, ...] = (0.01, 0.03, 0.06, 0.1, 0.16, 0.25)
    """Starting values of the fill time [s]."""
    finalists: int = 2
    """Starts whose fit is completed, of each part of the search."""
    iterations: int = 60
    """Largest number of iterations of a fit."""


SEARCH = SearchSettings()
_STEP = 2e-3
"""Step of the differences over the usual size of a parameter."""
_DETERMINED = 1.0
"""Change of the residuals, in standard deviations of all of them together, by a change of the
usual size, below which a parameter has no influence."""
_KISS, _FILL = (list(QUANTITIES).index(name) for name in ("kiss_pressure", "fill_time"))
_ACTUATOR_SCALE = (0.01, 0.02, 0.02, 0.5, 5e4, 0.05, 2e4)


@dataclass(frozen=True)
class Prior:
    """Mean and standard deviation of a usual range."""

    mean: float
    std: float


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Usual size, bounds and prior (k,) of each unknown, SI, those of the actuator first.

    The search scales an unknown by its size. `std` is infinite without a prior.
    """

    size: FloatArray
    lower: FloatArray
    upper: FloatArray
    mean: FloatArray
    std: FloatArray

    @classmethod
    def build_for_actuator(cls) -> Unknowns:
        """Return the parameters of the actuator without priors."""
        specs = QUANTITIES.values()
        return cls(
            np.array(_ACTUATOR_SCALE),
            np.array([one.lower for one in specs]),
            np.array([one.upper for one in specs]),
            np.zeros(len(specs)),
            np.full(len(specs), np.inf),
        )


class Residuals(Protocol):
    """Residuals (n,) of all records over the unknowns."""

    @property
    def unknowns(self) -> Unknowns:
        """The unknowns."""

    @property
    def linear(self) -> int:
        """Number of linear coefficients that each evaluation estimates beside the unknowns."""

    @property
    def noise(self) -> float:
        """Rough standard deviation of a residual, by which the priors are weighted."""

    def compute(self, values: FloatArray) -> FloatArray:
        """Residuals at values (k,), SI."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Values (k,) and their covariance (k, k), SI; infinite variances where undetermined.

    `rms` is that of the residuals with their degrees of freedom; `samples` counts them.
    """

    values: FloatArray
    covariance: FloatArray
    rms: float
    samples: int


def search_actuator(residuals: Residuals, expected_kiss: float) -> FloatArray:
    """Return the values (k,) with the least squares, SI.

    Kiss pressure and fill time have local minima. They are searched on a grid twice: coarsely with
    all starts of the other parameters, and finely with those that the first fit has found.
    """
    known = residuals.unknowns
    others = known.mean[len(QUANTITIES) :]
    kisses, fills = np.array(SEARCH.kiss_shares) * expected_kiss, np.array(SEARCH.fill_times)
    first = [
        np.concatenate([[dead, lag, lag, 1.0, kiss, fill, 1e4], others])
        for dead, lag, kiss, fill in product(
            SEARCH.dead_times, SEARCH.lags, kisses[::4], fills[::2]
        )
    ]
    fit = _fit_best(residuals, first)
    second = []
    for kiss, fill in product(kisses, fills):
        start = fit[0].copy()
        start[[_KISS, _FILL]] = kiss, fill
        second.append(start)
    return min(fit, _fit_best(residuals, second), key=lambda one: one[1])[0]


def _fit_best(residuals: Residuals, starts: Sequence[FloatArray]) -> tuple[FloatArray, float]:
    """Fit from the best of the starts; return the values and their cost."""
    from scipy.optimize import least_squares

    known = residuals.unknowns
    low, high = known.lower / known.size, known.upper / known.size

    def compute(scaled: FloatArray) -> FloatArray:
        return _weigh(residuals, scaled * known.size)

    def slope(scaled: FloatArray) -> FloatArray:
        return _linearise(residuals, scaled, with_priors=True)

    costs = [float(np.square(_weigh(residuals, one)).sum()) for one in starts]
    fits = [
        least_squares(
            compute,
            np.clip(starts[k] / known.size, low + 1e-6, high - 1e-6),
            slope,
            bounds=(low, high),
            xtol=1e-7,
            ftol=1e-9,
            max_nfev=SEARCH.iterations,
        )
        for k in np.argsort(costs)[: SEARCH.finalists]
    ]
    best = min(fits, key=lambda one: float(one.cost))
    return np.asarray(best.x * known.size, dtype=np.float64), float(best.cost)


def _weigh(residuals: Residuals, values: FloatArray) -> FloatArray:
    """Residuals and, for each prior, the deviation from it in units of the noise."""
    known = residuals.unknowns
    stated = np.isfinite(known.std)
    deviation = (values - known.mean)[stated] / known.std[stated]
    return np.concatenate([residuals.compute(values), residuals.noise * deviation])


def _linearise(residuals: Residuals, scaled: FloatArray, *, with_priors: bool) -> FloatArray:
    """Derivatives (n, k) by scaled values, from differences that stay within the bounds."""
    known = residuals.unknowns
    low, high = known.lower / known.size, known.upper / known.size
    columns = []
    for k in range(scaled.size):
        up, down = scaled.copy(), scaled.copy()
        up[k], down[k] = min(up[k] + _STEP, high[k]), max(down[k] - _STEP, low[k])
        ends = (
            _weigh(residuals, one * known.size)
            if with_priors
            else residuals.compute(one * known.size)
            for one in (up, down)
        )
        above, below = ends
        columns.append((above - below) / (up[k] - down[k]))
    return np.column_stack(columns)


def estimate_covariance(residuals: Residuals, values: FloatArray) -> Fit:
    """Estimate the covariance at the minimum, from the residuals and the priors."""
    known = residuals.unknowns
    left = residuals.compute(values)
    slopes = _linearise(residuals, values / known.size, with_priors=False)
    variance = float(left @ left) / max(left.size - values.size - residuals.linear, 1)
    influential = np.linalg.norm(slopes, axis=0) > _DETERMINED * np.sqrt(variance)
    columns = slopes[:, influential]
    information = columns.T @ columns / max(variance * compute_inflation(left), 1e-300)
    information += np.diag((known.size / known.std)[influential] ** 2)
    covariance = np.zeros((values.size, values.size))
    covariance[np.ix_(influential, influential)] = np.linalg.pinv(information)
    covariance *= np.outer(known.size, known.size)
    covariance[~influential, ~influential] = np.inf
    return Fit(values, covariance, float(np.sqrt(variance)), left.size)


def compute_inflation(left: FloatArray) -> float:
    """Factor on the variance of a mean by the autocorrelation of the residuals, at least 1.

    The sum of the autocorrelations ends at the first that is not above chance (2/√n).
    """
    centred = left - left.mean()
    power = float(centred @ centred)
    if power <= 0.0:
        return 1.0
    factor, limit = 1.0, 2.0 / np.sqrt(left.size)
    for lag in range(1, left.size // 4):
        share = float(centred[lag:] @ centred[:-lag]) / power
        if share <= limit:
            break
        factor += 2.0 * share
    return factor


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
