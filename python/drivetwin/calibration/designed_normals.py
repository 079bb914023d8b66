# SPDX-License-Identifier: MIT
"""Designed draws: points of a scrambled Sobol sequence as normal numbers.

Few designed draws stand for the spread far better than few random ones: a mean over n of them has
an error near 1/n in place of 1/√n. Source: A. Owen, Scrambling Sobol' and Niederreiter-Xing points,
J. Complexity 14 (1998).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from drivetwin._util.arrays import FloatArray

_DIMENSIONS = 64
"""Normal numbers of a unit that are designed: more than a twin has. Further ones are random."""


class DesignedNormals(np.random.Generator):
    """Generator whose normal numbers are the `row` (n,) of a design, then random by `seed`."""

    def __init__(self, row: FloatArray, seed: list[int]) -> None:
        super().__init__(np.random.PCG64(seed))
        self._row = row.tolist()[::-1]

    def standard_normal(self, size: Any = None, *_: Any, **__: Any) -> Any:
        """Return the next numbers of the design."""
        if size is None:
            return self._row.pop() if self._row else super().standard_normal()
        return np.array([self.standard_normal() for _ in range(int(np.prod(size)))]).reshape(size)

    def normal(self, loc: Any = 0.0, scale: Any = 1.0, size: Any = None) -> Any:
        """Return the next numbers of the design with a mean and a standard deviation."""
        return loc + scale * self.standard_normal(size)

    def multivariate_normal(self, mean: Any, cov: Any, *_: Any, **__: Any) -> Any:
        """Return the next numbers of the design with a mean (n,) and a covariance (n, n)."""
        values, vectors = np.linalg.eigh(cov)
        drawn = np.sqrt(np.maximum(values, 0.0)) * self.standard_normal(len(mean))
        return mean + vectors @ drawn


def list_designed(count: int, seed: list[int]) -> list[np.random.Generator]:
    """List the generators of `count` units; a power of two makes the design even."""
    rows = design_normals(count, _DIMENSIONS, np.random.default_rng(seed))
    return [DesignedNormals(row, [*seed, k]) for k, row in enumerate(rows)]


def design_normals(count: int, dimensions: int, random: np.random.Generator) -> FloatArray:
    """Return designed normal numbers (count, dimensions), scrambled by `random`."""
    sobol = qmc.Sobol(dimensions, seed=random)
    return np.asarray(ndtri(sobol.random_base2(max(0, (count - 1).bit_length()))[:count]))
