# SPDX-License-Identifier: MIT
"""Change-point estimation: hinge fits of the end or begin of rest, with sigma."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from drivetwin._util.arrays import FloatArray

_GRID = 80
"""Hinges compared before the best one is refined."""
_HIGHEST = 3
"""Highest power of the time from the hinge."""
_FINER = 10
"""Ratio of the steps of two grids: each gains a digit, about the best hinge of the one before
[-]."""
_RESOLUTION = 1.1e-5
"""Step at which the grids of hinges end [s]: 10 us, with the rounding of its tenths."""


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


@dataclass(frozen=True, eq=False)
class _Search:
    """Grid (m,) [s] of hinges with their `factors` (see `_Curves.reduce`), sign of movement."""

    grid: FloatArray
    factors: FloatArray
    direction: float


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
    curves = _Curves(time, values, moving.value)
    grid = np.linspace(*search, _GRID)
    direction = _detect_direction(time, values, moving, search)
    looked = _Search(grid, curves.reduce(grid), direction)
    fits = [
        fit
        for powers in moving.orders
        if (fit := _fit_curve(curves, looked, powers, noise_floor)) is not None
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


@dataclass(frozen=True, eq=False)
class _Curves:
    """Signal (n,) whose moving side is a polynomial in the time from the hinge."""

    time: FloatArray
    values: FloatArray
    side: int

    def build_basis(self, hinge: float, powers: tuple[int, ...]) -> FloatArray:
        """Columns (n, 1 + powers) of one hinge: the level and the powers."""
        x = np.clip(self.side * (self.time - hinge), 0.0, None)
        return np.column_stack([np.ones_like(x), *(x**power for power in powers)])

    def reduce(self, hinges: FloatArray) -> FloatArray:
        """Triangular factors (m, 5, 5) of level, powers 1 to 3 and values at `hinges` (m,) [s].

        Least-squares problems in any of these columns have the same solution and misfit as with
        all samples, because an orthogonal transform changes neither.
        """
        x = np.clip(self.side * (self.time - hinges[:, None]), 0.0, None)
        columns = np.empty((*x.shape, _HIGHEST + 2))
        columns[..., 0] = 1.0
        for power in range(1, _HIGHEST + 1):
            columns[..., power] = columns[..., power - 1] * x
        columns[..., -1] = self.values
        return np.asarray(np.linalg.qr(columns, mode="r"), dtype=np.float64)


def _solve_reduced(
    factors: FloatArray, powers: tuple[int, ...], samples: int
) -> tuple[FloatArray, FloatArray]:
    """Coefficients (m, 1 + powers) and sums of squares (m,) of the fits of `_Curves.reduce`.

    Singular values below the rounding error of `samples` rows count as zero, as in
    `numpy.linalg.lstsq`; the coefficients are then those of least norm.
    """
    columns = factors[:, :, [0, *powers, -1]]
    chosen = np.asarray(np.linalg.qr(columns, mode="r"), dtype=np.float64)
    count = len(powers) + 1
    square = np.ascontiguousarray(chosen[:, :count, :count])
    left, size, right = np.linalg.svd(square)
    projected = (left.transpose(0, 2, 1) @ chosen[:, :count, count:])[..., 0]
    kept = size > np.finfo(float).eps * samples * size[:, :1]
    solved = np.divide(projected, size, out=np.zeros_like(size), where=kept)
    coefficients = (right.transpose(0, 2, 1) @ solved[..., None])[..., 0]
    left_over = np.sum(np.where(kept, 0.0, projected) ** 2, axis=1)
    return coefficients, np.sum(chosen[:, count:, count] ** 2, axis=1) + left_over


def _fit_curve(
    curves: _Curves, search: _Search, powers: tuple[int, ...], floor: float
) -> _Fit | None:
    """Fit the hinge of one set of powers: the best of a grid, then of ever finer ones about it."""
    time, side, factors = curves.time, curves.side, search.factors
    samples, unknowns = len(time), len(powers) + 2
    if samples <= unknowns:
        return None
    grid, step = search.grid, float(np.ptp(search.grid[:2]))
    while True:
        every, misfits = _solve_reduced(factors, powers, samples)
        misfits = np.where(every[:, 1] * search.direction > 0.0, misfits, np.inf)
        best = int(np.argmin(misfits))
        hinge, coefficients, misfit = float(grid[best]), every[best], float(misfits[best])
        if not np.isfinite(misfit):
            return None
        if step <= _RESOLUTION:
            break
        grid = hinge + step * np.linspace(-1.0, 1.0, 2 * _FINER + 1)
        grid, step = np.clip(grid, search.grid[0], search.grid[-1]), step / _FINER
        factors = curves.reduce(grid)
    variance = max(misfit / (samples - unknowns), floor**2)
    basis = curves.build_basis(hinge, powers)
    sigma = _compute_sigma(curves, hinge, basis, (powers, coefficients)) * np.sqrt(variance)
    likelihood = samples * np.log(max(misfit / samples, floor**2))
    limit = 0.5 * (search.grid[-1] - search.grid[0])
    residual = curves.values - basis @ coefficients
    ahead = side * (time - hinge) > 0.0
    return _Fit(
        hinge,
        min(float(sigma), float(limit)),
        _compute_rms(residual[ahead], floor),
        float(likelihood + unknowns * np.log(samples)),
    )


def _compute_rms(residual: FloatArray, floor: float) -> float:
    return max(float(np.sqrt(np.mean(residual**2))) if len(residual) else 0.0, floor)


def _compute_sigma(
    curves: _Curves, hinge: float, basis: FloatArray, curve: tuple[tuple[int, ...], FloatArray]
) -> float:
    """Standard deviation of the hinge for unit noise (Gauss-Newton); inf where undetermined."""
    powers, coefficients = curve
    side = curves.side
    x = np.clip(side * (curves.time - hinge), 0.0, None)
    slope = sum(
        (a * p * x ** (p - 1) for p, a in zip(powers, coefficients[1:], strict=True)),
        start=np.zeros_like(x),
    )
    sensitivity = np.where(x > 0.0, -side * slope, 0.0)
    # Part of the hinge's sensitivity orthogonal to all other coefficients.
    own = sensitivity - basis @ np.linalg.lstsq(basis, sensitivity, rcond=None)[0]
    length = float(np.linalg.norm(own))
    return 1.0 / length if length > 0.0 else float("inf")
