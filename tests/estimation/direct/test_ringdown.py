# SPDX-License-Identifier: MIT
"""Lock-up oscillation: frequency and damping from made signals, refusal without one."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.errors import IdentificationError
from drivetwin.estimation.direct.ringdown import (
    compute_shaft_parameters,
    estimate_pencil_start,
)
from drivetwin.estimation.paper.pipeline import estimate_paper_ringdown
from drivetwin.likelihood.measured_signal import MeasuredSignal
from tests.support.arrays import FloatArray

TIME = np.arange(0.0, 2.0, 1e-3)
RATE, OMEGA = 4.5, 75.0


def ring(amplitude: float = 2000.0) -> FloatArray:
    wave = amplitude * np.exp(-RATE * TIME) * np.cos(OMEGA * TIME + 0.4)
    return np.asarray(1800.0 + 50.0 * TIME + wave, dtype=float)


@pytest.mark.parametrize("rate", [RATE, 28.9])
def test_a_pencil_finds_the_mode(rate: float) -> None:
    noise = 5.0 * np.random.default_rng(1).standard_normal(TIME.size)
    wave = 2000.0 * np.exp(-rate * TIME) * np.cos(OMEGA * TIME + 0.4) + noise
    found = estimate_pencil_start(TIME[:800], wave[:800])
    assert found == pytest.approx((rate, OMEGA), rel=0.02)


def test_paper_reads_the_extremes() -> None:
    found = estimate_paper_ringdown(MeasuredSignal(TIME, ring(), 10.0), 0.0, 2.0)
    assert found.omega_d == pytest.approx(OMEGA, rel=5e-3)
    assert found.decay_rate == pytest.approx(RATE, rel=0.05)
    assert found.extremes_time.size >= 6


def test_noise_alone_is_refused() -> None:
    noise = 30.0 * np.random.default_rng(3).standard_normal(TIME.size)
    with pytest.raises(IdentificationError, match="no clean lock-up oscillation"):
        estimate_paper_ringdown(MeasuredSignal(TIME, 1800.0 + noise, 30.0), 0.0, 2.0)


def test_too_short_a_stretch_is_refused() -> None:
    with pytest.raises(IdentificationError, match=r"less than 0\.15 s"):
        estimate_paper_ringdown(MeasuredSignal(TIME, ring(), 1.0), 1.85, 2.0)


def test_stiffness_and_damping_invert_the_two_mass_formulas() -> None:
    k, c, J4, J5 = 1.76e5, 280.0, 36.18, 209.23
    J = J4 * J5 / (J4 + J5)
    rate = c / (2.0 * J)
    omega = np.sqrt(k / J - rate**2)
    assert compute_shaft_parameters(rate, float(omega), J4, J5) == pytest.approx([k, c])
    with pytest.raises(IdentificationError, match="both must be positive"):
        compute_shaft_parameters(rate, float(omega), J4, -1.0)
