# SPDX-License-Identifier: MIT
"""Regression of a speed whose noise has three parts, each of unknown size.

    y = X·β + e,   cov(e) = r²·1 + a²·K_drift + d²·K_swing

r [rad/s] is white: rounding, time stamps and the sensor. a [rad/s²/√s] is a torque that drifts as a
random walk, which integrated gives the speed (grade, error of the torque message). d [rad/s/√s] is
a white torque that keeps the driveline swinging at its own frequency and damping (road, engine).
The sizes maximise the marginal likelihood with flat β, corrected by |XᵀX| so that it does not
depend on the scale of the columns, which change with frequency and damping (Francke, Koopman and
de Vos 2010).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.optimize import minimize

from drivetwin._util.arrays import FloatArray

_LOWEST = 1e-4
"""Smallest start of a noise part over the rms of the residual: the search is over logarithms."""
_JITTER = 1e-10
"""Share of the mean variance added to a covariance: a million times the rounding error of its
factors, and below any noise."""


@dataclass(frozen=True)
class Swing:
    """Oscillator: decay rate σ [1/s] and damped angular frequency ω [rad/s]."""

    rate: float
    omega: float


@dataclass(frozen=True)
class NoiseSize:
    """Sizes of white noise [rad/s], drift [rad/s²/√s] and swing [rad/s/√s]."""

    white: float
    drift: float
    swing: float = 0.0


@dataclass(frozen=True, eq=False)
class Regression:
    """Mean (n,) of the best coefficients and log likelihood.

    `best` is the log likelihood at the coefficients, comparable between sets of columns.
    """

    mean: FloatArray
    log_likelihood: float
    best: float


def build_drift_kernel(first: FloatArray, second: FloatArray) -> FloatArray:
    """Covariance (n, m) of an integrated random walk of unit intensity that starts at zero."""
    low = np.minimum(first[:, None], second)
    high = np.maximum(first[:, None], second)
    return np.asarray(low**2 * (3.0 * high - low) / 6.0)


def build_swing_kernel(first: FloatArray, second: FloatArray, swing: Swing) -> FloatArray:
    """Covariance (n, m) of an oscillator driven by white noise of unit intensity, stationary."""
    lag = np.abs(first[:, None] - second)
    return np.asarray(np.exp(-swing.rate * lag) * np.cos(swing.omega * lag) / (2.0 * swing.rate))


def build_covariance(
    time: FloatArray, size: NoiseSize, floor: float, swing: Swing | None
) -> FloatArray:
    """Covariance (n, n) of the noise at `time` (n,) from the first sample; `floor` [rad/s] is the
    smallest white noise: that of rounding."""
    drift = size.drift**2 * build_drift_kernel(time, time)
    if swing is not None and size.swing > 0.0:
        drift = drift + size.swing**2 * build_swing_kernel(time, time, swing)
    white = size.white**2 + floor**2 + _JITTER * float(np.trace(drift)) / time.size
    return np.asarray(drift + white * np.eye(time.size))


def regress(columns: FloatArray, values: FloatArray, covariance: FloatArray) -> Regression | None:
    """Generalised least squares of `values` (n,) on `columns` (n, p); None if singular."""
    try:
        factor = cho_factor(covariance, lower=True)
        weighted = cho_solve(factor, columns)
        information = columns.T @ weighted
        inner = cho_factor(information)
    except (LinAlgError, ValueError):
        return None
    mean = columns @ cho_solve(inner, weighted.T @ values)
    residual = values - mean
    square = residual @ cho_solve(factor, residual)
    log_k = 2.0 * np.sum(np.log(np.diag(factor[0])))
    log_x = np.linalg.slogdet(columns.T @ columns)[1]
    log_i = 2.0 * np.sum(np.log(np.diag(inner[0])))
    best = -0.5 * float(log_k + square)
    return Regression(mean, best - 0.5 * float(log_i - log_x), best)


def weigh_beside(others: FloatArray, covariance: FloatArray) -> FloatArray:
    """Weights (n, n) of samples with a `covariance` (n, n), beside the columns `others` (n, m) with
    free coefficients, which may depend on each other."""
    inverse = np.linalg.inv(covariance)
    across = inverse @ (others / np.maximum(np.linalg.norm(others, axis=0), 1e-300))
    gram = across.T @ covariance @ across
    return np.asarray(inverse - across @ np.linalg.pinv(gram, 1e-12, hermitian=True) @ across.T)


def solve_weighted(
    columns: FloatArray, values: FloatArray, weights: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Coefficients (p,) of the `columns` (n, p) in `values` (n,), with their information (p, p).

    A direction that the samples do not determine has no information.
    """
    information = columns.T @ weights @ columns
    unit = np.sqrt(np.maximum(np.diag(information), 1e-300))
    inverse = np.linalg.pinv(information / np.outer(unit, unit), 1e-9, hermitian=True)
    return inverse @ (columns.T @ weights @ values / unit) / unit, information


def fit_noise(
    time: FloatArray,
    columns: FloatArray,
    values: FloatArray,
    floor: float,
    swing: Swing | None,
    start: NoiseSize | None = None,
    known: FloatArray | None = None,
) -> NoiseSize:
    """Sizes of the noise parts of the greatest likelihood.

    Parameters
    ----------
    time : (n,) [s] from the first sample
    columns : (n, p) of the mean
    values : (n,) speed [rad/s]
    floor : standard deviation of rounding [rad/s]
    swing : oscillator, None for noise without it
    start : first sizes, None to take them from the residual of least squares
    known : covariance (n, n) of a part whose size is known, None for none
    """
    # The marginal likelihood is that of the part of the values that no column explains.
    rest = np.linalg.qr(columns, mode="complete")[0][:, columns.shape[1] :]
    left = rest.T @ values
    parts = [rest.T @ build_drift_kernel(time, time) @ rest]
    if swing is not None:
        parts.append(rest.T @ build_swing_kernel(time, time, swing) @ rest)
    rms = max(float(np.sqrt(np.mean(left**2))), floor, 1e-9)
    sizes = [rms / np.sqrt(float(np.trace(one)) / left.size) for one in parts]
    given = [] if start is None else [start.white, start.drift, start.swing][: 1 + len(parts)]
    first = np.maximum(given or [0.5 * rms, *(0.5 * one for one in sizes)], _LOWEST * rms)
    base = np.zeros_like(parts[0]) if known is None else rest.T @ known @ rest
    likelihood = _Likelihood(parts, base, left, floor)
    largest = np.log(np.array([rms, *sizes]) * 1e2)
    bounds = list(zip(np.minimum(np.log(first), largest) - 9.0, largest, strict=True))
    made = minimize(
        likelihood.evaluate,
        np.log(first),
        jac=True,
        method="L-BFGS-B",
        bounds=bounds,
        options={"maxiter": 60, "ftol": 1e-7},
    )
    return NoiseSize(*(float(one) for one in np.exp(made.x)))


@dataclass(frozen=True, eq=False)
class _Likelihood:
    """Negative log likelihood of white noise and several parts (m, m); that of `base` is known."""

    parts: list[FloatArray]
    base: FloatArray
    left: FloatArray
    floor: float

    def evaluate(self, logs: FloatArray) -> tuple[float, FloatArray]:
        """Value and gradient by the logarithms of the sizes."""
        size = np.exp(2.0 * logs)
        whole = self.base + sum(a * one for a, one in zip(size[1:], self.parts, strict=True))
        count = self.left.size
        white = size[0] + self.floor**2 + _JITTER * float(np.trace(whole)) / count
        try:
            factor = cho_factor(whole + white * np.eye(count), lower=True)
        except LinAlgError:
            return 1e12, np.zeros(size.size)
        inverse = cho_solve(factor, np.eye(count))
        pulled = inverse @ self.left
        slopes = [np.trace(inverse) - pulled @ pulled]
        slopes += [np.sum(inverse * one) - pulled @ one @ pulled for one in self.parts]
        value = float(np.sum(np.log(np.diag(factor[0]))) + 0.5 * self.left @ pulled)
        return value, size * np.array(slopes)
