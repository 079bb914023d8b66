# SPDX-License-Identifier: MIT
"""A linear mixed-effects model with known errors of each observation, by restricted likelihood.

    y_ij = x_ij·β + z_ij·b_i + e_ij,   b_i ~ N(0, diag(σ²)),   e_ij ~ N(0, d_ij)

i counts units, j the logs of one. d is the variance that a log states of itself, all scaled down
if the logs scatter less than they state, with a common variance added if they scatter more. With
one log of each unit this is not separable from σ, and d is the variance as stated.
Restricted likelihood after Harville, J. Am. Stat. Assoc. 72 (1977) 320; intervals of σ from its
profile. Per unit only q × q matrices occur (Woodbury), so that the cost is linear in the logs.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize
from scipy.stats import chi2, t

Interval = tuple[float, float]


@dataclass(frozen=True)
class Drift:
    """Change of the parameter with one unit of a field, 95 % interval; `reference` is the field's
    mean, at which the shared value holds. `spread` (1 σ) is how much units differ in it.
    """

    field: str
    slope: float
    ci95: Interval
    reference: float
    spread: float | None = None


@dataclass(frozen=True)
class UnitValue:
    """Deviation of a unit from the shared value, and its standard error.

    `score` is the deviation in robust standard deviations of all units; `odd` is true if it is
    significant.
    """

    unit: str
    logs: int
    deviation: float
    std: float
    score: float | None
    odd: bool


@dataclass(frozen=True)
class Outlier:
    """A log that does not fit: `score` standard deviations from what its unit and fields let
    expect, and what else is odd about it.
    """

    log: str
    path: str
    unit: str
    value: float
    expected: float
    score: float
    reason: str


@dataclass(frozen=True, eq=False)
class Points:
    """The logs behind an estimate, for figures: readings of the first field (NaN without one),
    values and standard deviations (n,), units (n,).
    """

    reading: FloatArray
    value: FloatArray
    std: FloatArray
    unit: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class JointEstimate:
    """Joint estimate of one parameter over the units of one rule.

    `value` is shared by all units, at the fields' references; `spread` (1 σ) is the scatter between
    units. `excess` is the ratio of the scatter of the logs to their stated uncertainty. `left_out`
    counts the logs without a value.
    """

    parameter: str
    rule: str
    si_unit: str
    logs: int
    left_out: int
    value: float
    ci95: Interval
    spread: float | None
    spread_ci95: Interval | None
    excess: float
    drifts: tuple[Drift, ...]
    units: tuple[UnitValue, ...]
    outliers: tuple[Outlier, ...]
    notes: tuple[str, ...]
    points: Points

    def to_document(self) -> dict[str, Any]:
        """For JSON, without the single points."""
        return {key: value for key, value in asdict(self).items() if key != "points"}


FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int_]

_CHI2_95 = float(chi2.ppf(0.95, 1))
_SMALLEST, _LARGEST = 1e-3, 1e3
"""Bounds of σ over the scatter of the observations; at the smaller one it counts as zero."""


@dataclass(frozen=True, eq=False)
class Observations:
    """Data of the mixed model.

    `y` (n,) are the values, with stated standard deviations `std` (n,). The unit of each is a
    number (n,) from 0. `x` (n, p) are the fixed effects and `z` (n, q) the random effects.
    """

    y: FloatArray
    std: FloatArray
    unit: IntArray
    x: FloatArray
    z: FloatArray

    @property
    def units(self) -> int:
        """Number of units."""
        return int(self.unit.max()) + 1


@dataclass(frozen=True, eq=False)
class MixedFit:
    """The fit: `beta` (p,) with `covariance` (p, p) and 95 % half widths `half` (p,).

    `sigma` (q,) is the spread over units with its 95 % intervals `sigma_ci` (q, 2); `deviation`
    (units, q) are the units' own effects with standard errors `deviation_std`. `variance` (n,) is
    d, `residual` (n,) what is left of y; `excess` is √(d/stated) of a typical log.
    """

    beta: FloatArray
    covariance: FloatArray
    half: FloatArray
    sigma: FloatArray
    sigma_ci: FloatArray
    deviation: FloatArray
    deviation_std: FloatArray
    variance: FloatArray
    residual: FloatArray
    excess: float


@dataclass(frozen=True, eq=False)
class _Weighted:
    """Sums over the logs with weights 1/d, which depend on w alone: Σ ln d, of x and y together,
    and by unit of z·zᵀ and of z·(x, y)ᵀ.
    """

    logs: float
    whole: FloatArray
    own: FloatArray
    cross: FloatArray


@dataclass(frozen=True, eq=False)
class _Solved:
    """β and what the likelihood is made of, for given variances."""

    deviance: float
    beta: FloatArray
    information: FloatArray
    middle: FloatArray
    pulls: FloatArray


class _Likelihood:
    """Minus twice the restricted log-likelihood over (w, ln σ): see `variance` for w."""

    def __init__(self, seen: Observations) -> None:
        self.seen = seen
        self.square = seen.std**2
        self.typical = float(np.median(self.square))
        self.weighted = lru_cache(8)(self._apply_weights)
        single = seen.z.shape[1] > 0 and seen.units == seen.y.size
        spreads = seen.z.shape[1] * [(np.log(_SMALLEST), np.log(_LARGEST))]
        self.bounds = [(0.0, 0.0) if single else (-6.0, 12.0), *spreads]

    def compute_variance(self, w: float) -> FloatArray:
        """d (n,): the stated variances times e^w below w = 0, plus a common one above."""
        if w <= 0.0:
            return self.square * float(np.exp(w))
        return self.square + self.typical * float(np.exp(w) - 1.0)

    def _compute_sums(self, left: FloatArray, right: FloatArray, weight: FloatArray) -> FloatArray:
        """Sums over each unit of left·weight·rightᵀ: (units, columns, columns)."""
        if not left.shape[1]:
            return np.zeros((self.seen.units, 0, right.shape[1]))
        products = left[:, :, None] * (weight[:, None] * right)[:, None, :]
        flat = products.reshape(len(products), -1)
        sums = [np.bincount(self.seen.unit, column, self.seen.units) for column in flat.T]
        shape = (self.seen.units, left.shape[1], right.shape[1])
        return np.stack(sums, axis=1).reshape(shape).astype(np.float64)

    def _apply_weights(self, w: float) -> _Weighted:
        seen, d = self.seen, self.compute_variance(w)
        weight, known = 1.0 / d, np.column_stack([self.seen.x, self.seen.y])
        return _Weighted(
            float(np.log(d).sum()),
            known.T @ (weight[:, None] * known),
            self._compute_sums(seen.z, seen.z, weight),
            self._compute_sums(seen.z, known, weight),
        )

    def solve(self, parameters: FloatArray) -> _Solved:
        """Everything for one (w, ln σ_1 … ln σ_q)."""
        root, sums = np.exp(parameters[1:]), self.weighted(float(parameters[0]))
        middle = np.eye(root.size) + sums.own * np.outer(root, root)
        cross = root[:, None] * sums.cross
        inside = np.linalg.solve(middle, cross)
        whole = sums.whole - np.einsum("uqk,uql->kl", cross, inside)
        size = self.seen.x.shape[1]
        information, pull = whole[:size, :size], whole[:size, size]
        beta = np.linalg.solve(information, pull)
        rest = float(whole[size, size] - pull @ beta)
        logs = sums.logs + np.linalg.slogdet(middle)[1].sum()
        deviance = float(logs + np.linalg.slogdet(information)[1] + rest)
        return _Solved(deviance, beta, information, middle, cross)

    def compute_deviance(self, parameters: FloatArray) -> float:
        """Minus twice the restricted log-likelihood, to a constant."""
        return self.solve(parameters).deviance


def fit_mixed_model(seen: Observations, *, intervals: bool = True) -> MixedFit:
    """Fit the model; y may have any scale. Needs n > p + q, and two units where q > 0.

    Without `intervals`, which take most of the time, `sigma_ci` is NaN.
    """
    scale = float(np.median(seen.std))
    root = 1.0 / seen.std
    start, *_ = np.linalg.lstsq(seen.x * root[:, None], seen.y * root, rcond=None)
    # Far from zero the sums of squares would lose the digits that the search lives on.
    centred = (seen.y - seen.x @ start) / scale
    scaled = Observations(centred, seen.std / scale, seen.unit, seen.x, seen.z)
    likelihood = _Likelihood(scaled)
    best = _find_minimum(likelihood)
    solved = likelihood.solve(best)
    sigma = np.where(np.exp(best[1:]) <= 2.0 * _SMALLEST, 0.0, np.exp(best[1:]))
    ci = np.full((sigma.size, 2), np.nan)
    if intervals:
        for k in range(sigma.size):
            ci[k] = _find_profile_interval(likelihood, best, 1 + k)
    covariance = np.asarray(np.linalg.inv(solved.information), dtype=np.float64)
    free = (seen.units if sigma.size else seen.y.size) - seen.x.shape[1]
    quantile = float(t.ppf(0.975, max(free, 1)))
    deviation, deviation_std = _predict_deviations(solved, np.exp(best[1:]))
    d = likelihood.compute_variance(float(best[0]))
    effects = np.sum(scaled.z * deviation[scaled.unit], axis=1)
    residual = scaled.y - scaled.x @ solved.beta - effects
    return MixedFit(
        beta=start + scale * solved.beta,
        covariance=np.asarray(scale**2 * covariance),
        half=scale * quantile * np.sqrt(np.diag(covariance)),
        sigma=scale * sigma,
        sigma_ci=scale * ci,
        deviation=scale * deviation,
        deviation_std=scale * deviation_std,
        variance=scale**2 * d,
        residual=scale * residual,
        excess=float(np.sqrt(np.median(d) / likelihood.typical)),
    )


def _find_minimum(likelihood: _Likelihood) -> FloatArray:
    """The best of a few starts: little and much spread over units."""
    count = likelihood.seen.z.shape[1]
    found = [
        minimize(
            likelihood.compute_deviance,
            np.array([0.0, *[np.log(spread)] * count]),
            method="L-BFGS-B",
            bounds=likelihood.bounds,
        )
        for spread in (0.1, 3.0)
    ]
    return np.asarray(min(found, key=lambda one: float(one.fun)).x)


def _find_profile_interval(
    likelihood: _Likelihood, best: FloatArray, place: int
) -> tuple[float, float]:
    """Find where the profile deviance is 3.84 above its minimum: a 95 % interval of σ."""
    others = [k for k in range(best.size) if k != place]
    bounds = [likelihood.bounds[k] for k in others]
    lowest = likelihood.compute_deviance(best)

    def above(log_sigma: float) -> float:
        def deviance(free: FloatArray) -> float:
            parameters = np.empty_like(best)
            parameters[place], parameters[others] = log_sigma, free
            return likelihood.compute_deviance(parameters)

        found = minimize(deviance, best[others], method="L-BFGS-B", bounds=bounds)
        return float(found.fun) - lowest - _CHI2_95

    low, high = np.log(_SMALLEST), np.log(_LARGEST)
    middle = float(best[place])
    below = 0.0 if above(low) < 0.0 else float(np.exp(brentq(above, low, middle, xtol=1e-2)))
    beyond = np.inf if above(high) < 0.0 else float(np.exp(brentq(above, middle, high, xtol=1e-2)))
    return below, beyond


def _predict_deviations(solved: _Solved, root: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Best prediction of each unit's effects and its standard error, β's own error included."""
    inverse = np.linalg.inv(solved.middle)
    pulls = solved.pulls
    size = solved.beta.size
    residual = pulls[:, :, size] - pulls[:, :, :size] @ solved.beta
    deviation = root * np.einsum("uqk,uk->uq", inverse, residual)
    spread = np.einsum("q,uqk,k->uqk", root, inverse, root)
    slope = np.einsum("q,uqk,ukp->uqp", root, inverse, pulls[:, :, :size])
    spread = spread + slope @ np.linalg.inv(solved.information) @ np.swapaxes(slope, 1, 2)
    return deviation, np.sqrt(np.einsum("uqq->uq", spread))
