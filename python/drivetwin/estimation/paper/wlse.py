# SPDX-License-Identifier: MIT
"""Weighted least squares of the paper: weights from the plausible range of each sample's quotient.

The paper does not specify how it differentiates speeds. Here signals are averaged over windows of
10 ms, and speeds are differenced centrally between the neighbouring windows (THEORY section 4). The
method is kept as the reference; section 5 and the modulating functions need no derivative.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import IdentificationError
from drivetwin.estimation.direct.load_balance import WINDOW


@dataclass(frozen=True)
class GridRow:
    """One row of the paper's Table 1: grid value, inertia [kg m^2], RMS error [N m]."""

    value: float
    inertia: float
    rmse: float


@dataclass(frozen=True)
class Weighting:
    """Plausible inertia range [kg m^2]; samples inside it weigh 1, others `outside`."""

    low: float
    high: float
    outside: float = 0.01


@dataclass(frozen=True, eq=False)
class GridFit:
    """A grid search by weighted least squares.

    `rows` as tabulated, `best` the row of least RMS error. `acceleration` (n,) [rad/s^2] and
    `torque` (n,) [N m] are the scatter at the best grid value, `torque_start` (n,) that at the
    first grid value (the paper's comparison), `weights` (n,) those of the best row.
    """

    rows: tuple[GridRow, ...]
    best: GridRow
    acceleration: FloatArray
    torque: FloatArray
    torque_start: FloatArray
    weights: FloatArray


def compute_central_difference(values: FloatArray, width: float = WINDOW) -> FloatArray:
    """Slope of window means (n,) from the neighbours of each inner window; shape (n-2,)."""
    return (values[2:] - values[:-2]) / (2.0 * width)


def fit_weighted_inertia(
    torque: FloatArray, acceleration: FloatArray, weighting: Weighting, scale: float = 1.0
) -> tuple[float, FloatArray]:
    """Slope J of torque = J·acceleration by weighted least squares, and the weights (n,).

    `scale`·torque/acceleration of a sample is compared with the range of `weighting`.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = scale * torque / acceleration
    plausible = (quotient >= weighting.low) & (quotient <= weighting.high)
    weights = np.where(plausible, 1.0, weighting.outside)
    normal = float(weights @ acceleration**2)
    if normal == 0.0:
        raise IdentificationError(
            "the speed is constant throughout the held gear, so no inertia shows",
            "record a run in which the vehicle accelerates in gear",
        )
    return float(weights @ (acceleration * torque)) / normal, weights
