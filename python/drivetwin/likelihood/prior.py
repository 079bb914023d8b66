# SPDX-License-Identifier: MIT
"""Normal prior of the unknowns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Prior:
    """Normal prior on θ: `mean` (p,) and `precision` (p, p), zero rows where nothing is known."""

    mean: FloatArray
    precision: FloatArray

    @classmethod
    def from_independent(cls, size: int, entries: Mapping[int, tuple[float, float]]) -> Prior:
        """Independent priors by parameter index: (mean, standard deviation > 0)."""
        mean, precision = np.zeros(size), np.zeros((size, size))
        for index, (value, std) in entries.items():
            mean[index], precision[index, index] = value, std**-2
        return cls(mean, precision)

    def append(self, value: float, std: float) -> Prior:
        """Copy the prior with one more parameter, independent of the others."""
        precision = np.pad(self.precision, (0, 1))
        precision[-1, -1] = std**-2
        return Prior(np.append(self.mean, value), precision)

    def fix_parameter(self, index: int, value: float) -> Prior:
        """Copy the prior with one parameter fixed at `value`."""
        mean, precision = self.mean.copy(), self.precision.copy()
        mean[index] = value
        precision[index, :] = precision[:, index] = 0.0
        precision[index, index] = 1e18
        return Prior(mean, precision)

    def linearise(self, theta: FloatArray) -> Prior:
        """Return the prior with a precision that holds at `theta` (p,): itself, as it is linear."""
        del theta
        return self

    def compute_gradient(self, theta: FloatArray) -> FloatArray:
        """Precision times (θ - θ₀), shape (p,)."""
        return np.asarray(self.precision @ (theta - self.mean), dtype=float)

    def compute_prior_cost(self, theta: FloatArray) -> float:
        """(θ - θ₀)ᵀ P⁻¹ (θ - θ₀)."""
        return float((theta - self.mean) @ self.compute_gradient(theta))
