# SPDX-License-Identifier: MIT
"""Ratio of residual power to sensor noise."""

from __future__ import annotations

import numpy as np

from drivetwin.identify.likelihood.fit import LikelihoodFit, covariance_of, spread_of
from drivetwin.identify.signals import FloatArray


def noise_power(fit: LikelihoodFit, rows: FloatArray) -> float:
    """Compute the ratio of residual power, slow errors included, to sensor noise: the mean over
    the independent directions of the unknowns that `rows` (k, p) span."""
    covariance = rows @ covariance_of(fit.normal.information) @ rows.T
    spread = rows @ spread_of(fit.problem, fit.normal, fit.chi2) @ rows.T
    scale = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    inverse = np.linalg.pinv(covariance / scale, hermitian=True)
    return float(np.sum(inverse * (spread / scale))) / len(rows)
