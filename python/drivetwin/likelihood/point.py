# SPDX-License-Identifier: MIT
"""Point of the unknowns, normal equations there, and priors: shared by optimisers and problems."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from mmap import mmap
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray
from drivetwin.simulation.variable import Variable


@dataclass(frozen=True, eq=False)
class ParameterVector:
    """Named parameter vector: one value for each free parameter; immutable."""

    names: tuple[str, ...]
    values: FloatArray

    def __getitem__(self, name: str) -> float:
        return float(self.values[self.names.index(name)])

    def to_variables(self, plain: Collection[str] = ()) -> ParameterVector:
        """Return a vector of the same parameters that carry their derivatives by one another, but
        for those that are to stay `plain`."""
        return _VariableVector(self.names, self.values, plain)

    def replace_values(self, values: FloatArray) -> ParameterVector:
        """Return a vector of the same parameters with other `values` (p,)."""
        return ParameterVector(self.names, values)


@dataclass(frozen=True, eq=False)
class _VariableVector(ParameterVector):
    """Parameter vector whose elements are variables, but for the `plain` ones."""

    plain: Collection[str]

    def __getitem__(self, name: str) -> float:
        place = self.names.index(name)
        if name in self.plain:
            return float(self.values[place])
        slopes = np.zeros(len(self.names))
        slopes[place] = 1.0
        return Variable(float(self.values[place]), slopes)


_MAPPED = 1 << 20
"""Size from which columns are mapped [bytes]."""


def find_acting(columns: FloatArray) -> NDArray[np.intp]:
    """Return the numbers of the `columns` (n, p) that are not zero throughout.

    In a fit of several logs most unknowns act on one log alone.
    """
    return np.flatnonzero(np.any(columns, axis=0))


def place_columns(acting: FloatArray, index: NDArray[np.intp], count: int) -> FloatArray:
    """Return `count` columns (n, count), zero but for those `acting` (n, k) at the places `index`
    (k,).

    Each is contiguous, so that the system assigns no memory to the zeros. Large arrays that are
    mostly zero are mapped: the allocator writes zeros into memory that was in use before.
    """
    shape = (len(acting), count)
    if 8 * len(acting) * count < _MAPPED or 2 * index.size > count:
        found = np.zeros(shape, order="F")
    else:
        found = np.ndarray(shape, buffer=mmap(-1, 8 * shape[0] * shape[1]), order="F")
    found[:, index] = acting
    return found


def scale_columns(columns: FloatArray, scale: FloatArray) -> FloatArray:
    """Return `columns` (n, p) times `scale` (p,), as `place_columns`."""
    acting = find_acting(columns)
    return place_columns(columns[:, acting] * scale[acting], acting, columns.shape[1])


def select_columns(columns: FloatArray, picked: Sequence[int]) -> FloatArray:
    """Return some of `columns` (n, p), as `place_columns`."""
    order = np.asarray(picked, dtype=np.intp)
    kept = np.flatnonzero(np.isin(order, find_acting(columns)))
    return place_columns(columns[:, order[kept]], kept, order.size)


def join_columns(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return columns (n, p + q), as `place_columns`."""
    own, other = find_acting(first), find_acting(second)
    both = np.column_stack([first[:, own], second[:, other]])
    index = np.concatenate([own, first.shape[1] + other])
    return place_columns(both, index, first.shape[1] + second.shape[1])


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Q and its Gauss-Newton expansion at one point: half gradient (p,), information (p, p).

    `data` (p, p) is the information of the measurements alone. Per group of residuals: `residuals`
    (n,), the derivatives of the model outputs `slopes` (n, p), and `regressors` (n, p), Σ⁻¹ times
    these.
    """

    cost: float
    gradient: FloatArray
    information: FloatArray
    data: FloatArray
    residuals: tuple[FloatArray, ...]
    regressors: tuple[FloatArray, ...]
    slopes: tuple[FloatArray, ...] = ()

    @property
    def excess(self) -> float:
        """Return Q per residual, at least 1: a difference of Q over it is one of deviations."""
        return max(self.cost / max(sum(one.size for one in self.residuals), 1), 1.0)


class Objective(Protocol):
    """Weighted sum of squares Q(θ) with bounds on θ; `lower` and `upper` (p,)."""

    @property
    def lower(self) -> FloatArray:
        """Lower bounds (p,)."""

    @property
    def upper(self) -> FloatArray:
        """Upper bounds (p,)."""

    @property
    def log_determinant(self) -> float:
        """log|Σ| of the weighting."""

    def cost(self, point: ParameterVector) -> float:
        """Compute Q; infinite if the model cannot be evaluated."""

    def normal(self, point: ParameterVector) -> NormalEquations | None:
        """Compute the Gauss-Newton expansion of Q; None if the model cannot be evaluated."""

    def retract(self, point: ParameterVector, step: FloatArray) -> FloatArray:
        """Compute the values (p,) after a `step` (p,) along the parameter manifold."""


class CurvedObjective(Objective, Protocol):
    """Objective that measures how its residuals bend."""

    def compute_curvature(
        self, point: ParameterVector, normal: NormalEquations, step: FloatArray, share: float
    ) -> FloatArray | None:
        """Compute the weighted second derivative of the residuals along a `step` (p,) by the
        unknowns, Jᵀ Σ⁻¹ r'' (p,), from the residuals after a `share` of it; None where the model
        cannot be evaluated there."""


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
