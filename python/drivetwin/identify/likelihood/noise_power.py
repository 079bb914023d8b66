# SPDX-License-Identifier: MIT
"""By how much the residuals of a fit exceed the noise that its sensors show."""

from __future__ import annotations

import numpy as np

from drivetwin.identify.likelihood.fit import LikelihoodFit, covariance_of, spread_of
from drivetwin.identify.signals import FloatArray


def noise_power(fit: LikelihoodFit, rows: FloatArray) -> float:
    """How many times the noise that the sensors show the residuals have, slow errors counted: the
    mean over the directions of the unknowns that `rows` (k, p) span, which are independent."""
    covariance = rows @ covariance_of(fit.normal.information) @ rows.T
    spread = rows @ spread_of(fit.problem, fit.normal, fit.chi2) @ rows.T
    scale = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    inverse = np.linalg.pinv(covariance / scale, hermitian=True)
    return float(np.sum(inverse * (spread / scale))) / len(rows)
