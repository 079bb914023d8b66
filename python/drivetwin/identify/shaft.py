# SPDX-License-Identifier: MIT
"""Output shaft from the lock-up oscillation (eqs. 12-14), the paper's way and by a fit.

    J4 = J′(h)·i_h²,  J5 = J3/i_f²,  1/J = 1/J4 + 1/J5
    ω_d = 2πf = ω_n·sqrt(1 - ζ²),  k_o = J·ω_n²,  c_o = 2ζ·sqrt(J·k_o)

J5 is J3 referred to the output shaft (the paper's text leaves the reflection out).
"""

from __future__ import annotations

import numpy as np

from drivetwin.driveline import in_series
from drivetwin.errors import IdentificationError
from drivetwin.identify.signals import FloatArray


def stiffness_and_damping(decay_rate: float, omega_d: float, J4: float, J5: float) -> FloatArray:
    """(k_o [N m/rad], c_o [N m s/rad]) from the oscillation and the inertias it swings between.

    `decay_rate` σ = ζ·ω_n [1/s], `omega_d` [rad/s], so ω_n² = σ² + ω_d². `J4`, `J5` [kg m^2] are
    at the output shaft. Raises IdentificationError unless both inertias are positive.
    """
    if not (J4 > 0.0 and J5 > 0.0):
        raise IdentificationError(
            f"inertias {J4:.4g} and {J5:.4g} kg·m² on the two sides of the output shaft",
            "check the inertia and load fits of this log: both must be positive",
        )
    J = in_series(J4, J5)
    return np.array([J * (decay_rate**2 + omega_d**2), 2.0 * decay_rate * J])
