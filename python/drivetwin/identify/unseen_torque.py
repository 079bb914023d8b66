# SPDX-License-Identifier: MIT
"""How well a ring-down is told where torques that no sensor shows move the shaft beside it.

What the fit of a ring-down leaves of the output torque is noise of its sensor, white, and the
shaft's response to torques on its ends that the fit does not know: noise in the engine torque that
drives the fit, what the engine does between two of its samples, the road. These are strongest where
the ring is, by the square of its quality factor. So what is left tells how strong they are
(variance components by restricted likelihood; Patterson and Thompson 1971).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from drivetwin.identify.signals import FloatArray

PER_PERIOD = 8
"""Knots of an unknown torque in a period of the ring."""
MOST_KNOTS = 200
"""Most knots: as many fill the longest stretch at 16 Hz, and faster rings have died away before."""
SEEN = 1e-6
"""Least response, as a share of the strongest, that counts as one."""
TINY = float(np.finfo(float).tiny)
RATIOS = np.logspace(-3.0, 8.0, 45)
"""Power of unknown torques over that of noise, both as the strongest response shows them."""


@dataclass(frozen=True, eq=False)
class Left:
    """What a fit leaves: `residual` (n,), in which `explained` (n, p) has no part, and `sigma`, the
    least white noise of a sample [N m].

    `response` (n, m) is that to unit torques at m knots, `known` (m,) the variance there of what
    is known to be unknown [N²m²].
    """

    residual: FloatArray
    explained: FloatArray
    sigma: float
    response: FloatArray
    known: FloatArray


def knots_of(time: FloatArray, omega: float) -> FloatArray:
    """Knots (m,) [s] between which an unknown torque runs straight, for a ring of ω [rad/s]."""
    span = float(time[-1] - time[0])
    step = max(2.0 * np.pi / omega / PER_PERIOD, span / MOST_KNOTS, span / (time.size - 1))
    return np.linspace(time[0], time[-1], int(span / step + 1e-9) + 1)


def hats(time: FloatArray, knots: FloatArray) -> FloatArray:
    """Weights (n, m) of the knots (m,) in a torque at `time` (n,) that runs straight between."""
    distance = np.abs(time[:, None] - knots) / (knots[1] - knots[0])
    return np.asarray(np.maximum(1.0 - distance, 0.0))


def variances(left: Left) -> tuple[float, FloatArray]:
    """Variance of the sensor's noise, and of the torque at each knot (m,), as expected of `left`.

    Each ratio of the two powers weighs by its likelihood, all standard deviations of the torque
    being as likely beforehand: the most likely one alone is often zero, and then too little.
    """
    q, _ = np.linalg.qr(left.explained)
    basis, strength, mixture = np.linalg.svd(
        left.response - q @ (q.T @ left.response), full_matrices=False
    )
    kept = strength > SEEN * strength[0]
    basis, seen = basis[:, kept], (strength[:, None] * mixture)[kept]
    shown = basis.T @ left.residual
    rest = max(float(left.residual @ left.residual - shown @ shown), 0.0)
    freedom = left.residual.size - q.shape[1]
    floor = max(left.sigma**2, SEEN * float(np.max(left.known)) * strength[0] ** 2, TINY)
    noisy = np.eye(shown.size) + (seen * (left.known / floor)) @ seen.T
    power, modes = eigh(seen @ seen.T, noisy)
    ratios = RATIOS / strength[0] ** 2
    variance = 1.0 + ratios[:, None] * np.maximum(power, 0.0)
    square = np.sum((modes.T @ shown) ** 2 / variance, axis=1) + rest
    noise = np.maximum(square / freedom, floor)
    cost = np.sum(np.log(variance), axis=1) + freedom * np.log(noise) + square / noise
    weight = np.exp(-0.5 * (cost - cost.min())) * np.sqrt(ratios)
    weight /= weight.sum()
    return float(weight @ noise), float(weight @ (ratios * noise)) + left.known


def covariance(left: Left, slopes: FloatArray) -> FloatArray:
    """Covariance (p, p) of least squares with the residual's derivatives `slopes` (n, p)."""
    noise, torque = variances(left)
    inverse = np.linalg.inv(slopes.T @ slopes)
    acting = inverse @ (slopes.T @ left.response)
    return np.asarray(noise * inverse + (acting * torque) @ acting.T)
