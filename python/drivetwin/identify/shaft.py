# SPDX-License-Identifier: MIT
"""Output shaft from the lock-up oscillation (eqs. 12-14), the paper's way and by a fit.

    J4 = J′(h)·i_h²,  J5 = J3/i_f²,  1/J = 1/J4 + 1/J5
    ω_d = 2πf = ω_n·sqrt(1 - ζ²),  k_o = J·ω_n²,  c_o = 2ζ·sqrt(J·k_o)

J5 is J3 referred to the output shaft (the paper's text leaves the reflection out).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin.errors import IdentificationError
from drivetwin.identify.ringdown import RingDown
from drivetwin.identify.signals import FloatArray


@dataclass(frozen=True)
class ShaftFit:
    """k_o [N m/rad], c_o [N m s/rad] with their covariance (2, 2), and the inertias behind them.

    `J4`, `J5` and their series `J` [kg m^2] are at the output shaft.
    """

    k_o: float
    c_o: float
    covariance: FloatArray
    J4: float
    J5: float
    J: float


def shaft_from_ring(
    ring: RingDown, J4: float, J5: float, inertia_covariance: FloatArray
) -> ShaftFit:
    """Stiffness and damping from the oscillation and the two inertias it swings between.

    `inertia_covariance` (2, 2) is that of (J4, J5). Errors propagate to first order through
    ω_n² = σ² + ω_d², with decay rate σ = ζ·ω_n.
    """
    if not (J4 > 0.0 and J5 > 0.0):
        raise IdentificationError(
            f"inertias {J4:.4g} and {J5:.4g} kg m^2 on the two sides of the output shaft",
            "check the inertia and load fits of this log: both must be positive",
        )
    J = 1.0 / (1.0 / J4 + 1.0 / J5)
    rate, omega = ring.decay_rate, ring.omega_d
    k_o, c_o = J * (rate**2 + omega**2), 2.0 * rate * J
    by_inertia = np.array([(J / J4) ** 2, (J / J5) ** 2])
    slopes = np.array(
        [
            [2.0 * J * rate, 2.0 * J * omega, *(k_o / J * by_inertia)],
            [2.0 * J, 0.0, *(c_o / J * by_inertia)],
        ]
    )
    covariance = np.zeros((4, 4))
    covariance[:2, :2] = ring.covariance
    covariance[2:, 2:] = inertia_covariance
    return ShaftFit(k_o, c_o, slopes @ covariance @ slopes.T, J4, J5, J)
