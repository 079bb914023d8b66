# SPDX-License-Identifier: MIT
"""Coefficients of the Stribeck law as unknowns of a fit: μ over slip, derivatives and priors."""

from __future__ import annotations

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.simulation.dual_clutch import Stribeck

MU_C, MU_DROP, MU_V, LOG_V, P0 = range(5)
LAW_PRIOR = {MU_C: (0.12, 0.2), MU_DROP: (0.0, 0.1), MU_V: (0.0, 2e-3), LOG_V: (np.log(15.0), 1.0)}
"""Wide priors of the Stribeck law: wet clutch facings; v_s within a factor e of 15 rad/s."""


def evaluate_stribeck(theta: FloatArray, slip: FloatArray) -> tuple[FloatArray, FloatArray]:
    """μ (n,) over |slip| (n,) and its derivatives (4, n) by (mu_c, mu_drop, mu_v, ln v_s)."""
    mu_c, drop, mu_v, ln_v_s = (float(theta[k]) for k in (MU_C, MU_DROP, MU_V, LOG_V))
    law = Stribeck(mu_c, mu_c + drop, float(np.exp(ln_v_s)), mu_v)
    return law.evaluate(slip), law.compute_slopes(slip)


def build_law_derivatives(v_s: float) -> FloatArray:
    """Derivatives (4, 4) of mu_c, mu_s, v_s, mu_v by (mu_c, mu_drop, mu_v, ln v_s)."""
    return np.array([[1.0, 0, 0, 0], [1, 1, 0, 0], [0, 0, 0, v_s], [0, 0, 1, 0]])
