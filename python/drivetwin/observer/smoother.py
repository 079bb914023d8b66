# SPDX-License-Identifier: MIT
"""Kalman filter and Rauch-Tung-Striebel smoother of a linear model that changes with time.

The backward pass is in the form of Bryson and Frazier (1963), which inverts no covariance: locked
elements and constant parameters make covariances singular. Measurements are scalars, taken one
after the other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from drivetwin.observer.result import FloatArray

Measurement = tuple[FloatArray, float, float]
"""Row (n,) of the state, the value read and its variance."""


@dataclass(frozen=True, eq=False)
class Process:
    """x_{k+1} = F_k·x_k + b_k + noise of covariance diag(q_k); F (N-1, n, n), b and q (N-1, n).

    `mean` (n,) and `covariance` (n, n) are those of the start; `measurements[k]` are taken at
    grid point k; `impulses[k]` (n, n) is further noise that enters before grid point k.
    """

    transition: FloatArray
    push: FloatArray
    noise: FloatArray
    mean: FloatArray
    covariance: FloatArray
    measurements: Sequence[Sequence[Measurement]]
    impulses: Mapping[int, FloatArray] = field(default_factory=dict)

    def predict_state(self, k: int, x: FloatArray, P: FloatArray) -> tuple[FloatArray, FloatArray]:
        """State and covariance at grid point k before its measurements, from those at k-1."""
        F = self.transition[k - 1]
        P = F @ P @ F.T
        P[np.diag_indices(x.size)] += self.noise[k - 1]
        if k in self.impulses:
            P += self.impulses[k]
        return F @ x + self.push[k - 1], P


@dataclass(frozen=True, eq=False)
class Filtered:
    """State (N, n) and covariance (N, n, n) given the past; -2·log-likelihood of the log."""

    mean: FloatArray
    covariance: FloatArray
    surprise: float


def filter_forward(process: Process) -> Filtered:
    """Forward pass."""
    x, P = process.mean.copy(), process.covariance.copy()
    count, size = len(process.measurements), x.size
    means, covariances = np.empty((count, size)), np.empty((count, size, size))
    surprise = 0.0
    for k in range(count):
        if k > 0:
            x, P = process.predict_state(k, x, P)
        for row, value, variance in process.measurements[k]:
            along = P @ row
            power = float(row @ along) + variance
            miss = value - float(row @ x)
            x = x + along * (miss / power)
            P = P - np.outer(along, along / power)
            surprise += miss * miss / power + float(np.log(power))
        means[k], covariances[k] = x, P
    return Filtered(means, covariances, surprise)


def smooth_states(process: Process) -> tuple[FloatArray, FloatArray]:
    """State (N, n) and covariance (N, n, n) given the whole log."""
    forward = filter_forward(process)
    means, covariances = forward.mean.copy(), forward.covariance.copy()
    size = process.mean.size
    pull, weight = np.zeros(size), np.zeros((size, size))
    for k in range(len(process.measurements) - 1, -1, -1):
        P = forward.covariance[k]
        means[k] = forward.mean[k] - P @ pull
        covariances[k] = P - P @ weight @ P
        pull, weight = _propagate_adjoint(process, forward, k, pull, weight)
    return means, covariances


def _propagate_adjoint(
    process: Process, forward: Filtered, k: int, pull: FloatArray, weight: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Adjoint state and its weight after grid point k-1, from those after point k."""
    x, P = process.mean, process.covariance
    if k > 0:
        x, P = process.predict_state(k, forward.mean[k - 1], forward.covariance[k - 1])
    stages = []
    for row, value, variance in process.measurements[k]:
        along = P @ row
        power = float(row @ along) + variance
        miss = value - float(row @ x)
        stages.append((row, along / power, power, miss))
        x = x + along * (miss / power)
        P = P - np.outer(along, along / power)
    for row, gain, power, miss in reversed(stages):
        # (I - gain·row)ᵀ from the left, and from the right for the weight.
        pull = pull - row * (float(gain @ pull) + miss / power)
        side = weight @ gain
        weight = (
            weight
            - np.outer(row, side)
            - np.outer(side, row)
            + np.outer(row, row) * (float(gain @ side) + 1.0 / power)
        )
    if k == 0:
        return pull, weight
    F = process.transition[k - 1]
    return F.T @ pull, F.T @ weight @ F
