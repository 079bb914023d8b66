# SPDX-License-Identifier: MIT
"""Change-point estimation: hinge fits of departure from, or return to, rest, with sigma."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

FloatArray = NDArray[np.float64]

_GRID = 80


class Moving(Enum):
    """On which side of the hinge the signal moves."""

    BEFORE = -1
    AFTER = 1

    @property
    def orders(self) -> tuple[tuple[int, ...], ...]:
        """Powers of the time from the hinge that the moving side may have.

        Slip ends with a finite rate, because the friction torque jumps at lock-up. It begins with
        a finite rate where the kinetic capacity lies below the static one, and with zero slip
        acceleration (powers from 2) where the two are equal.
        """
        if self is Moving.BEFORE:
            return ((1,), (1, 2), (1, 2, 3))
        return ((1,), (2,), (1, 2), (2, 3), (1, 2, 3))


@dataclass(frozen=True)
class Hinge:
    """A hinge in time: `time` ± `sigma` [s].

    `noise_moving` is the RMS residual of the best fit on the moving side, in the signal's unit;
    more than the noise of the signal indicates lack of fit.
    """

    time: float
    sigma: float
    noise_moving: float


@dataclass(frozen=True)
class _Fit:
    time: float
    sigma: float
    noise_moving: float
    information: float
    """Bayesian information criterion of the fit."""


def fit_hinge(
    time: FloatArray,
    values: FloatArray,
    moving: Moving,
    search: tuple[float, float],
    noise_floor: float,
) -> Hinge | None:
    """Locate the hinge of y = level + Σ a_p·x^p, x = time on the moving side of the hinge, else 0.

    `time`, `values` (n,) hold both sides; the hinge is sought within `search` [s]. Fits of several
    orders are averaged with weights exp(-BIC/4) (Schwarz 1978; Hoeting et al. 1999; half the usual
    exponent, because the caller chooses the window from the same data), so that `sigma` includes
    noise and the unknown form of the onset. `noise_floor` (signal unit) is a lower bound of the
    noise. Returns None if nothing moves.
    """
    direction = _detect_direction(time, values, moving, search)
    fits = [
        fit
        for powers in moving.orders
        if (fit := _fit_curve(time, values, moving, (search, powers, direction, noise_floor)))
    ]
    if not fits:
        return None
    information = np.array([fit.information for fit in fits])
    weight = np.exp(-0.25 * (information - information.min()))
    weight /= weight.sum()
    times = np.array([fit.time for fit in fits])
    centre = float(weight @ times)
    variance = weight @ (np.array([fit.sigma for fit in fits]) ** 2 + (times - centre) ** 2)
    best = fits[int(information.argmin())]
    return Hinge(centre, float(np.sqrt(variance)), best.noise_moving)


def _detect_direction(
    time: FloatArray, values: FloatArray, moving: Moving, search: tuple[float, float]
) -> float:
    """Sign of the movement away from rest."""
    side = moving.value
    outer = search[1] if side > 0 else search[0]
    far = values[side * (time - outer) >= 0.0]
    near = values[side * (time - outer) < 0.0]
    if not len(far) or not len(near):
        return 0.0
    return float(np.sign(np.mean(far) - np.median(near)))


def _build_basis(time: FloatArray, hinge: float, side: int, powers: tuple[int, ...]) -> FloatArray:
    x = np.clip(side * (time - hinge), 0.0, None)
    return np.column_stack([np.ones_like(x), *(x**power for power in powers)])


def _fit_curve(
    time: FloatArray,
    values: FloatArray,
    moving: Moving,
    form: tuple[tuple[float, float], tuple[int, ...], float, float],
) -> _Fit | None:
    search, powers, direction, floor = form
    side = moving.value
    unknowns = len(powers) + 2
    if len(time) <= unknowns:
        return None

    def solve(hinge: float) -> tuple[FloatArray, float]:
        basis = _build_basis(time, hinge, side, powers)
        coefficients = np.asarray(np.linalg.lstsq(basis, values, rcond=None)[0], dtype=np.float64)
        misfit = float(np.sum((values - basis @ coefficients) ** 2))
        return coefficients, misfit

    def cost(hinge: float) -> float:
        coefficients, misfit = solve(hinge)
        return misfit if coefficients[1] * direction > 0.0 else np.inf

    grid = np.linspace(*search, _GRID)
    costs = np.array([cost(hinge) for hinge in grid])
    if not np.isfinite(costs).any():
        return None
    best = int(np.argmin(costs))
    bracket = (grid[max(best - 1, 0)], grid[min(best + 1, _GRID - 1)])
    refined = float(minimize_scalar(lambda h: solve(h)[1], bounds=bracket, method="bounded").x)
    hinge = refined if cost(refined) <= costs[best] else float(grid[best])
    coefficients, misfit = solve(hinge)
    variance = max(misfit / (len(time) - unknowns), floor**2)
    sigma = _compute_sigma(time, hinge, side, (powers, coefficients)) * np.sqrt(variance)
    likelihood = len(time) * np.log(max(misfit / len(time), floor**2))
    limit = 0.5 * (search[1] - search[0])
    residual = values - _build_basis(time, hinge, side, powers) @ coefficients
    ahead = side * (time - hinge) > 0.0
    return _Fit(
        hinge,
        min(float(sigma), limit),
        _compute_rms(residual[ahead], floor),
        float(likelihood + unknowns * np.log(len(time))),
    )


def _compute_rms(residual: FloatArray, floor: float) -> float:
    return max(float(np.sqrt(np.mean(residual**2))) if len(residual) else 0.0, floor)


def _compute_sigma(
    time: FloatArray, hinge: float, side: int, curve: tuple[tuple[int, ...], FloatArray]
) -> float:
    """Standard deviation of the hinge for unit noise (Gauss-Newton); inf where undetermined."""
    powers, coefficients = curve
    basis = _build_basis(time, hinge, side, powers)
    x = np.clip(side * (time - hinge), 0.0, None)
    slope = sum(
        (a * p * x ** (p - 1) for p, a in zip(powers, coefficients[1:], strict=True)),
        start=np.zeros_like(x),
    )
    sensitivity = np.where(x > 0.0, -side * slope, 0.0)
    # Part of the hinge's sensitivity orthogonal to all other coefficients.
    own = sensitivity - basis @ np.linalg.lstsq(basis, sensitivity, rcond=None)[0]
    length = float(np.linalg.norm(own))
    return 1.0 / length if length > 0.0 else float("inf")
