# SPDX-License-Identifier: MIT
"""Least squares where every number in the equations is measured (errors in variables).

The equations are r(θ) = Σ_c A_c(θ)·y_c = 0: each row combines samples of several channels c with
coefficients that depend on the parameters θ. With independent noise of variance σ_c² the
maximum-likelihood estimate, the true signals eliminated, minimises

    Q(θ) = rᵀ S⁻¹ r + (θ - θ₀)ᵀ P⁻¹ (θ - θ₀),   S(θ) = Σ_c σ_c² A_c A_cᵀ

Its gradient is that of generalised least squares with an instrument: the regressors evaluated at
the signals y_c - σ_c² A_cᵀ S⁻¹ r, from which the noise that enters the residual has been taken
out. Hence no attenuation by noise in the regressors, and overlapping windows are weighted by
their correlation (structured total least squares; Van Huffel and Vandewalle 1991).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded, solve_banded

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import IdentificationError
from drivetwin.estimation.regression.modulating_functions import Quadrature
from drivetwin.likelihood.gauss_newton import minimise_with_line_search
from drivetwin.likelihood.point import NormalEquations, ParameterVector, Prior

NUGGET = 1e-9
"""Added to S relative to its diagonal: strongly overlapping windows are nearly dependent."""


@dataclass(frozen=True, eq=False)
class Term:
    """One channel's part of the equations, at one θ.

    It adds factor ∘ (quadrature · y) to r; y (n,) are the samples, `sigma` their white noise
    (0 for an exact quantity). `slopes[p]` are the pairs (factor, quadrature) of ∂/∂θ_p.
    """

    values: FloatArray
    sigma: float
    quadrature: Quadrature
    factor: FloatArray
    slopes: Mapping[int, tuple[FloatArray, Quadrature]]


@dataclass(frozen=True, eq=False)
class Fit:
    """Estimate `theta` (p,), `covariance` (p, p) from noise and priors, and its residuals.

    `residual` (m,) at the estimate; `chi2` is Q per degree of freedom without the prior.
    """

    theta: FloatArray
    covariance: FloatArray
    residual: FloatArray
    q: float
    chi2: float

    @property
    def std(self) -> FloatArray:
        """Standard errors (p,), inflated where the residuals exceed the stated noise."""
        return np.asarray(np.sqrt(np.diag(self.covariance)), dtype=float)


@dataclass(frozen=True, eq=False)
class BandedCholesky:
    """S = L·Lᵀ for a covariance that couples only windows near each other in the list.

    `lower` (k+1, m) holds the diagonals of L.
    """

    lower: FloatArray

    @classmethod
    def from_covariance(cls, cov: FloatArray) -> BandedCholesky:
        """Factor of `cov` (m, m), its bandwidth found from its zeros.

        Raises IdentificationError where it is no covariance: the search has left all reason.
        """
        if not np.isfinite(cov).all() or not np.diag(cov).all():
            raise _build_weight_error()
        row, column = np.nonzero(cov)
        width = int(np.max(row - column))
        band = np.zeros((width + 1, cov.shape[0]))
        for k in range(width + 1):
            band[k, : cov.shape[0] - k] = np.diagonal(cov, -k)
        try:
            return cls(cholesky_banded(band, lower=True))
        except np.linalg.LinAlgError:
            raise _build_weight_error() from None

    def solve(self, x: FloatArray) -> FloatArray:
        """S⁻¹x for x (m,) or (m, r)."""
        return np.asarray(cho_solve_banded((self.lower, True), x), dtype=float)

    def whiten(self, x: FloatArray) -> FloatArray:
        """L⁻¹x for x (m,) or (m, r)."""
        return np.asarray(solve_banded((self.lower.shape[0] - 1, 0), self.lower, x), dtype=float)


def _build_weight_error() -> IdentificationError:
    return IdentificationError(
        "the noise of the channels gives the equations no finite weights",
        "look at the channels with 'drivetwin inspect': one is damaged, or in another unit",
    )


@dataclass(frozen=True, eq=False)
class _Evaluation:
    """Residual (m,) of the equations at one θ, its weighted square and the derivatives of both."""

    residual: FloatArray
    q: float
    gradient: FloatArray
    regressors: FloatArray
    factor: BandedCholesky

    @property
    def information(self) -> FloatArray:
        """Information (p, p) of the equations, with the noise left in the regressors."""
        return np.asarray(self.regressors.T @ self.factor.solve(self.regressors), dtype=float)


class _Equations:
    """Objective of the equations with a prior and without bounds; holds the last evaluation."""

    log_determinant = 0.0

    def __init__(
        self, assemble: Callable[[FloatArray], Sequence[Term]], size: int, prior: Prior
    ) -> None:
        self.assemble, self.prior = assemble, prior
        self.lower, self.upper = np.full(size, -np.inf), np.full(size, np.inf)
        self._last: tuple[FloatArray, _Evaluation] | None = None

    def evaluate(self, theta: FloatArray) -> _Evaluation:
        """Evaluate the equations at θ (p,)."""
        if self._last is None or self._last[0] is not theta:
            self._last = theta, _evaluate(self.assemble(theta), theta.size)
        return self._last[1]

    def cost(self, point: ParameterVector) -> float:
        """Compute Q(θ)."""
        return self.evaluate(point.values).q + self.prior.compute_prior_cost(point.values)

    def normal(self, point: ParameterVector) -> NormalEquations:
        """Compute the Gauss-Newton expansion of Q at θ."""
        result = self.evaluate(point.values)
        data = result.information
        return NormalEquations(
            self.cost(point),
            result.gradient + self.prior.compute_gradient(point.values),
            data + self.prior.precision,
            data,
            (result.residual,),
            (result.regressors,),
        )

    def retract(self, point: ParameterVector, step: FloatArray) -> FloatArray:
        """Compute the values (p,) after a straight `step` (p,)."""
        return point.values + step


def _compute_residual_covariance(terms: Sequence[Term]) -> FloatArray:
    """S (m, m): covariance of the residuals from the noise of all channels."""
    cov = np.zeros((terms[0].factor.size,) * 2)
    for t in terms:
        if t.sigma > 0.0:
            cov += np.outer(t.sigma**2 * t.factor, t.factor) * t.quadrature.gram
    cov[np.diag_indices_from(cov)] *= 1.0 + NUGGET
    return cov


def build_whitening(terms: Sequence[Term]) -> Callable[[FloatArray], FloatArray]:
    """The map x -> L⁻¹x with S = L·Lᵀ, under which the residuals have unit covariance."""
    return BandedCholesky.from_covariance(_compute_residual_covariance(terms)).whiten


def compute_regressors(terms: Sequence[Term], size: int) -> FloatArray:
    """∂r/∂θ (m, size) at the measured signals."""
    columns = np.zeros((terms[0].factor.size, size))
    for t in terms:
        for index, (slope, quadrature) in t.slopes.items():
            columns[:, index] += slope * (quadrature.matrix @ t.values)
    return columns


def _evaluate(terms: Sequence[Term], size: int) -> _Evaluation:
    count = terms[0].factor.size
    residual = np.zeros(count)
    for t in terms:
        residual += t.factor * (t.quadrature.matrix @ t.values)
    cov = _compute_residual_covariance(terms)
    factor = BandedCholesky.from_covariance(cov)
    multiplier = factor.solve(residual)
    columns = np.zeros((count, size))
    for t in terms:
        clean = t.values
        if t.sigma > 0.0:
            clean = clean - t.sigma**2 * (t.quadrature.matrix.T @ (t.factor * multiplier))
        for index, (slope, quadrature) in t.slopes.items():
            columns[:, index] += slope * (quadrature.matrix @ clean)
    gradient = columns.T @ multiplier
    return _Evaluation(residual, float(residual @ multiplier), gradient, columns, factor)


def _estimate_spurious_information(
    terms: Sequence[Term], point: _Evaluation, size: int
) -> FloatArray:
    """Expected part of the information (p, p) that the noise left in the regressors feigns."""
    inverse = point.factor.solve(np.eye(point.residual.size))
    cross = np.zeros((size, point.residual.size, point.residual.size))
    own = np.zeros((size, size))
    overlap = functools.cache(Quadrature.compute_overlap)  # terms of a channel share quadratures
    for t in terms:
        for p, (f, k) in t.slopes.items():
            cross[p] += t.sigma**2 * np.outer(f, t.factor) * overlap(k, t.quadrature)
            for q, (g, h) in t.slopes.items():
                own[p, q] += t.sigma**2 * float(f @ (inverse * overlap(k, h)) @ g)
    shared = np.empty((size, size))
    for p, block in enumerate(cross):
        weighted = inverse @ block @ inverse
        shared[p] = [float(np.sum(weighted * other)) for other in cross]
    return own - shared


def solve(
    assemble: Callable[[FloatArray], Sequence[Term]],
    start: FloatArray,
    prior: Prior,
    tolerance: float = 1e-3,
) -> Fit:
    """Minimise Q(θ) from `start` (p,) by Gauss-Newton; stop at `tolerance` standard errors.

    Raises IdentificationError where the equations leave a direction of θ undetermined.
    """
    values = np.asarray(start, dtype=float).copy()
    equations = _Equations(assemble, values.size, prior)
    names = tuple(str(k) for k in range(values.size))
    theta = minimise_with_line_search(
        equations,
        ParameterVector(names, values),
        lambda m, gradient: _compute_information_inverse(m) @ gradient,
        tolerance,
    ).point.values
    point = equations.evaluate(theta)
    information = point.information - _estimate_spurious_information(
        assemble(theta), point, theta.size
    )
    chi2 = point.q / max(point.residual.size - theta.size, 1)
    # Residuals above the stated noise scale down the information of the data, not of the prior.
    covariance = _compute_information_inverse(
        _clip_curvature(information) / max(1.0, chi2) + prior.precision
    )
    return Fit(
        theta,
        covariance,
        point.residual,
        point.q,
        chi2,
    )


def _clip_curvature(matrix: FloatArray) -> FloatArray:
    """The nearest matrix without negative curvature, in units of its own diagonal."""
    scale = np.sqrt(np.maximum(np.abs(np.diag(matrix)), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    lifted = (vectors * np.maximum(values, 0.0)) @ vectors.T
    return np.asarray(lifted * np.outer(scale, scale), dtype=float)


def _compute_information_inverse(information: FloatArray) -> FloatArray:
    """Inverse of an information matrix, balanced by its diagonal.

    Raises IdentificationError where a direction carries no information.
    """
    scale = np.sqrt(np.maximum(np.diag(information), 0.0))
    if not np.all(np.isfinite(scale)) or np.any(scale == 0.0):
        raise IdentificationError(
            "a parameter does not act on any of the equations",
            "record a run in which engine torque and speed change",
        )
    balanced = information / np.outer(scale, scale)
    if np.linalg.cond(balanced) > 1e14:
        raise IdentificationError(
            "the equations do not separate some of the parameters",
            "record a run in which engine torque and speed change independently",
        )
    return np.asarray(np.linalg.inv(balanced) / np.outer(scale, scale), dtype=float)
