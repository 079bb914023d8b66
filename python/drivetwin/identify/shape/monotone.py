# SPDX-License-Identifier: MIT
"""A curve that only falls or only rises, nearest to a free one in the metric of its covariance.

    min (μ - μ̂)ᵀ C⁻¹ (μ - μ̂)   where all steps of μ have one sign

It is the constrained maximum of the likelihood as far as that is quadratic about the free one (He
and Shi 1998 for splines in general). With μ = A·x the constraint is x ≥ 0, and steps that rest at
0 take no part in the covariance.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import lsq_linear

from drivetwin.identify.shape.kind import Shape
from drivetwin.identify.signals import FloatArray


def shaped(shape: Shape, mu: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """μ (K,) at the knots and its covariance (K, K) under `shape`, from those of a free fit."""
    if shape is Shape.FREE:
        return mu, covariance
    matrix = np.tril(np.ones((mu.size, mu.size)))
    if shape is Shape.FALLING:
        matrix = matrix[::-1]
    scale = np.sqrt(np.diag(covariance))
    root = np.linalg.inv(np.linalg.cholesky(covariance / np.outer(scale, scale)))
    weighted = root @ (matrix / scale[:, None])
    lower = np.concatenate([[-np.inf], np.zeros(mu.size - 1)])
    found = lsq_linear(weighted, root @ (mu / scale), bounds=(lower, np.inf), tol=1e-12)
    moving = np.flatnonzero(found.active_mask == 0)
    inverse = np.linalg.inv(weighted[:, moving].T @ weighted[:, moving])
    within = matrix[:, moving] @ inverse @ matrix[:, moving].T
    return np.asarray(matrix @ found.x), np.asarray(within)
