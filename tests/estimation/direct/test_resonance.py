# SPDX-License-Identifier: MIT
"""A decay is estimated with its uncertainty where there is one, and refused where there is none."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.errors import IdentificationError
from drivetwin.estimation.direct.resonance import fit_resonance
from drivetwin.likelihood.measured_signal import MeasuredSignal
from tests.support.arrays import FloatArray

TIME = np.arange(5.0, 8.0, 0.02)


def speed(swing: FloatArray, seed: int = 0, noise: float = 0.1) -> MeasuredSignal:
    rng = np.random.default_rng(seed)
    return MeasuredSignal(
        TIME, 150.0 + 4.0 * (TIME - 5.0) + swing + noise * rng.normal(size=TIME.size)
    )


def decay(f: float, zeta: float) -> FloatArray:
    omega = 2.0 * np.pi * f
    rate = omega * zeta / np.sqrt(1.0 - zeta**2)
    return np.asarray(4.0 * np.exp(-rate * (TIME - 5.0)) * np.cos(omega * (TIME - 5.0)))


@pytest.mark.parametrize(("f", "zeta"), [(4.4, 0.08), (7.0, 0.05), (11.0, 0.04)])
def test_a_decay_is_found(f: float, zeta: float) -> None:
    found = fit_resonance(speed(decay(f, zeta)), 5.0, 8.0)
    assert abs(found.f_d - f) < max(3.0 * found.f_d_std, 0.05)
    assert abs(found.zeta - zeta) < max(3.0 * found.zeta_std, 0.02)
    assert found.f_d_std < 0.1 * f
    assert found.span[0] >= 5.0


@pytest.mark.parametrize("seed", range(4))
def test_noise_is_refused(seed: int) -> None:
    rough = np.cumsum(np.random.default_rng(seed).normal(size=TIME.size))
    with pytest.raises(IdentificationError, match="no clean decay"):
        fit_resonance(speed(0.5 * rough, seed), 5.0, 8.0)


def test_a_steady_swing_is_refused() -> None:
    with pytest.raises(IdentificationError, match="no clean decay"):
        fit_resonance(speed(2.0 * np.sin(2.0 * np.pi * 5.0 * TIME)), 5.0, 8.0)


def test_too_short_a_gear_is_refused() -> None:
    with pytest.raises(IdentificationError, match="no clean decay"):
        fit_resonance(speed(decay(4.4, 0.08)), 5.0, 5.4)
