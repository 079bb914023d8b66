# SPDX-License-Identifier: MIT
"""Least-squares fits of decaying sines on a quadratic trend, many windows at a time.

Variable projection: amplitudes and trend are linear, so that only decay rate and frequency are
searched, with the approximate Jacobian of Kaufman (1975) and the damping of Marquardt (1963).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray

_SCALE = np.array([2.0, 5.0])
"""Usual sizes of rate [1/s] and angular frequency [rad/s]."""
_STEPS = 25
"""Most steps of a search; a decay that stands out takes fewer than twelve."""
_CONVERGED = 1e-10
"""Relative decrease of the misfit at which a search has converged."""
_STUCK = 1e8
"""Damping from which on a search cannot descend further."""
_DIFFERENCE = 3e-6
"""Relative step of the differences that give a Jacobian."""
_STEEPEST = 50.0
"""Largest exponent of the decay."""
_SINGULAR = 1e-14
"""Share of the trace added to a Gram matrix, which is singular at zero frequency."""


@dataclass(frozen=True, eq=False)
class Windows:
    """Windows (w, n) of samples, padded at their end; `inside` is 1 for samples, 0 for padding.

    `rest` holds the values without their quadratic trend, `trend` (w, n, 3) an orthonormal basis of
    it. `time` [s] counts from the first sample of each window.
    """

    time: FloatArray
    inside: FloatArray
    rest: FloatArray
    trend: FloatArray

    @classmethod
    def stack(cls, times: Sequence[FloatArray], values: Sequence[FloatArray]) -> Windows:
        """Stack the samples of several windows; each has more than three."""
        shape = len(times), max(time.size for time in times)
        time, inside, padded = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        powers = np.zeros((*shape, 3))
        for index, (stamps, samples) in enumerate(zip(times, values, strict=True)):
            time[index, : stamps.size] = stamps
            inside[index, : stamps.size] = 1.0
            padded[index, : stamps.size] = samples
            powers[index, : stamps.size] = np.vander(stamps / stamps[-1], 3)
        trend = np.linalg.qr(powers)[0]
        return cls(time, inside, _remove(trend, padded[..., None])[..., 0], trend)

    def select(self, kept: NDArray[np.intp]) -> Windows:
        """Return the windows at the indices `kept` (k,)."""
        return Windows(self.time[kept], self.inside[kept], self.rest[kept], self.trend[kept])


def fit_decaying_sines(windows: Windows, omega: FloatArray, rate: float) -> FloatArray:
    """Return decay rate [1/s] and angular frequency [rad/s] of each window, (w, 2).

    The search starts at `omega` (w,) [rad/s] and `rate` [1/s].
    """
    found = np.column_stack([np.full(omega.size, rate), omega])
    damping = np.full(omega.size, 1e-3)
    active = np.arange(omega.size)
    for _ in range(_STEPS):
        part = windows.select(active)
        here = found[active]
        cost, slopes, curvature = _linearize(part, here)
        size = np.einsum("wii->wi", curvature)
        damped = curvature + damping[active, None, None] * size[:, :, None] * np.eye(2)
        step = -np.linalg.solve(damped + _tiny(size), slopes[..., None])[..., 0]
        gain = cost - compute_misfits(part, here + step)
        better = gain >= 0.0
        found[active[better]] += step[better]
        damping[active] *= np.where(better, 0.1, 10.0)
        converged = better & (gain <= _CONVERGED * cost)
        active = active[~converged & (damping[active] < _STUCK)]
        if not active.size:
            break
    return found


def compute_misfits(windows: Windows, parameters: FloatArray) -> FloatArray:
    """Sum of squares (w,) that the best sines of rate and frequency `parameters` (w, 2) leave."""
    return np.asarray(np.sum(_project(windows, parameters)[2] ** 2, axis=1))


def differentiate_residuals(windows: Windows, parameters: FloatArray) -> FloatArray:
    """Derivatives (w, n, 2) of the residuals by rate and frequency, amplitudes following."""
    slopes = []
    for index, size in enumerate(_SCALE):
        step = np.zeros(2)
        step[index] = _DIFFERENCE * size
        ahead, behind = (_project(windows, parameters + sign * step)[2] for sign in (1.0, -1.0))
        slopes.append((ahead - behind) / (2.0 * step[index]))
    return np.stack(slopes, axis=-1)


def _project(windows: Windows, parameters: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Sine columns without trend (w, n, 2), their amplitudes (w, 2) and residuals (w, n)."""
    columns = _remove(windows.trend, _make_sines(windows, parameters))
    amplitudes = _solve(columns, windows.rest[..., None])
    return columns, amplitudes[..., 0], windows.rest - (columns @ amplitudes)[..., 0]


def _make_sines(windows: Windows, parameters: FloatArray) -> FloatArray:
    """Decaying cosine and sine (w, n, 2), zero in the padding."""
    rate, omega = parameters[:, :1], parameters[:, 1:]
    fall = windows.inside * np.exp(-np.clip(rate * windows.time, -_STEEPEST, _STEEPEST))
    angle = omega * windows.time
    return np.stack([fall * np.cos(angle), fall * np.sin(angle)], axis=-1)


def _linearize(
    windows: Windows, parameters: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Misfit (w,), half its gradient (w, 2) and half its approximate Hessian (w, 2, 2)."""
    columns, amplitudes, residual = _project(windows, parameters)
    sines = _make_sines(windows, parameters)
    along = (sines @ amplitudes[..., None])[..., 0]
    across = sines[..., 0] * amplitudes[:, 1:] - sines[..., 1] * amplitudes[:, :1]
    change = windows.time[..., None] * np.stack([-along, across], axis=-1)
    change = _remove(windows.trend, change)
    jacobian = columns @ _solve(columns, change) - change
    turned = jacobian.transpose(0, 2, 1)
    slopes = (turned @ residual[..., None])[..., 0]
    return np.sum(residual**2, axis=1), slopes, turned @ jacobian


def _remove(basis: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns (w, n, c) without their part in an orthonormal `basis` (w, n, b)."""
    return np.asarray(columns - basis @ (basis.transpose(0, 2, 1) @ columns))


def _solve(columns: FloatArray, targets: FloatArray) -> FloatArray:
    """Least-squares coefficients (w, 2, c) of `targets` (w, n, c) in `columns` (w, n, 2)."""
    turned = columns.transpose(0, 2, 1)
    gram = turned @ columns
    return np.asarray(np.linalg.solve(gram + _tiny(np.einsum("wii->wi", gram)), turned @ targets))


def _tiny(diagonal: FloatArray) -> FloatArray:
    """Matrices (w, 2, 2) that keep a system with this `diagonal` (w, 2) solvable."""
    smallest = np.finfo(float).tiny
    size = _SINGULAR * diagonal.sum(axis=1) + smallest
    return np.asarray(size[:, None, None] * np.eye(2))
