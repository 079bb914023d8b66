# SPDX-License-Identifier: MIT
"""Lock-up oscillation: frequency and damping from made signals, refusal without one."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.estimation.linear.ringdown import (
    Drive,
    compute_forced_response,
    compute_shaft_parameters,
    fit_ringdown,
)
from drivetwin.estimation.paper.pipeline import estimate_paper_ringdown
from tests.support.arrays import FloatArray
from tests.support.coverage import FULL, assert_covers, vary_draws

TIME = np.arange(0.0, 2.0, 1e-3)
RATE, OMEGA = 4.5, 75.0


def ring(amplitude: float = 2000.0) -> FloatArray:
    wave = amplitude * np.exp(-RATE * TIME) * np.cos(OMEGA * TIME + 0.4)
    return np.asarray(1800.0 + 50.0 * TIME + wave, dtype=float)


@vary_draws(slow=True)
def test_fit_is_unbiased_and_its_intervals_cover(draws: int) -> None:
    """They are wide: the covariance allows for a torque that is not there (99 % are covered)."""
    rates, omegas, inside = [], [], np.zeros(2, dtype=int)
    for seed in range(draws):
        noise = 30.0 * np.random.default_rng(seed).standard_normal(TIME.size)
        found = fit_ringdown(MeasuredSignal(TIME, ring() + noise, 30.0), 0.0, 2.0, None)
        rates.append(found.decay_rate)
        omegas.append(found.omega_d)
        inside[0] += abs(found.f_d - OMEGA / (2 * np.pi)) < 1.96 * found.f_d_std
        inside[1] += abs(found.zeta - RATE / np.hypot(RATE, OMEGA)) < 1.96 * found.zeta_std
    assert np.mean(omegas) == pytest.approx(OMEGA, rel=5e-4)
    assert np.mean(rates) == pytest.approx(RATE, rel=0.01)
    for count in inside:
        assert_covers(count, draws, conservative=True)


HIGH_RATE, HIGH_OMEGA = 28.9, 190.5
"""A ring in a high gear: 30 Hz, 3.3 samples of 10 ms a period, and a damping ratio of 0.15."""


def high_gear(amplitude: float, seed: int) -> MeasuredSignal:
    time = np.arange(0.0, 1.6, 0.01)
    wave = amplitude * np.exp(-HIGH_RATE * time) * np.cos(HIGH_OMEGA * time + 0.4 + seed)
    noise = 20.0 * np.random.default_rng(seed).standard_normal(time.size)
    return MeasuredSignal(time, 1000.0 + 40.0 * time + wave + noise, 20.0)


@vary_draws(slow=True)
def test_a_ring_of_three_samples_a_period_is_told_with_intervals_that_cover(draws: int) -> None:
    found = [fit_ringdown(high_gear(400.0, k), 0.0, 1.6, None, after=0.015) for k in range(draws)]
    rates = np.array([ring.decay_rate for ring in found])
    std = np.sqrt([ring.covariance[0, 0] for ring in found])
    omegas = np.array([ring.omega_d for ring in found])
    assert np.mean(rates) == pytest.approx(HIGH_RATE, rel=0.08)
    assert np.mean(omegas) == pytest.approx(HIGH_OMEGA, rel=0.01)
    assert_covers(int(np.count_nonzero(np.abs(rates - HIGH_RATE) < 1.96 * std)), draws)


@pytest.mark.parametrize("amplitude", [0.0, 160.0])
def test_a_ring_lost_in_the_noise_is_refused(amplitude: float) -> None:
    for seed in range(40):
        with pytest.raises(IdentificationError, match="no clean lock-up oscillation"):
            fit_ringdown(high_gear(amplitude, seed), 0.0, 1.6, None)


def test_a_ring_that_the_samples_do_not_resolve_is_refused() -> None:
    time = np.arange(0.0, 1.6, 0.01)
    wave = 900.0 * np.exp(-6.0 * time) * np.cos(2.0 * np.pi * 47.0 * time)
    with pytest.raises(IdentificationError, match="no clean lock-up oscillation"):
        fit_ringdown(MeasuredSignal(time, 1000.0 + wave, 20.0), 0.0, 1.6, None)


def test_a_moving_engine_torque_is_accounted_for() -> None:
    push = 800.0 * np.clip((TIME - 0.3) / 0.08, 0.0, 1.0)
    torque = ring() + compute_forced_response(RATE, OMEGA, TIME, push)
    drive = Drive(MeasuredSignal(TIME, 500.0 + push / 1.2), 1.2)
    told = fit_ringdown(MeasuredSignal(TIME, torque, 1.0), 0.0, 2.0, drive)
    blind = fit_ringdown(MeasuredSignal(TIME, torque, 1.0), 0.0, 2.0, None)
    assert told.decay_rate == pytest.approx(RATE, rel=2e-3)
    assert abs(blind.decay_rate / RATE - 1.0) > 0.03


JITTER = 20.0
"""Standard deviation of the engine's own torque between samples of 10 ms, and that of its sensor
[N m]."""


def jittering(own: float, seen: float, seed: int) -> tuple[MeasuredSignal, Drive]:
    """A ring under an engine torque that changes by itself, measured every 10 ms with noise."""
    random = np.random.default_rng(seed)
    knots = np.arange(-0.2, 2.01, 0.01)
    acting = own * random.standard_normal(knots.size)
    before = np.arange(-0.2, 2.0, 1e-3)
    push = compute_forced_response(RATE, OMEGA, before, np.interp(before, knots, acting))[200:]
    torque = ring(600.0) + push + 3.0 * random.standard_normal(TIME.size)
    measured = 500.0 + acting + seen * random.standard_normal(knots.size)
    return MeasuredSignal(TIME, torque, 3.0), Drive(MeasuredSignal(knots, measured, seen), 1.0)


@vary_draws(slow=True)
@pytest.mark.parametrize(("own", "seen"), [(0.0, JITTER), (JITTER, 1.0), (JITTER, JITTER)])
def test_intervals_cover_under_a_torque_that_jitters(
    own: float, seen: float, draws: int, request: pytest.FixtureRequest
) -> None:
    """White noise in their place would have the two values in 55 to 75 % of 95 % intervals.

    The covariance allows for a torque that may not be there: without one 99 % are covered.
    """
    if (own, seen, draws) == (JITTER, JITTER, FULL):
        reason = "measured: 92.0 % of 1000 intervals of the decay rate cover"
        request.applymarker(pytest.mark.xfail(reason=reason, strict=True))
    inside = np.zeros(2, dtype=int)
    for seed in range(draws):
        torque, drive = jittering(own, seen, seed)
        found = fit_ringdown(torque, 0.0, 2.0, drive)
        errors = np.array([found.decay_rate - RATE, found.omega_d - OMEGA])
        inside += np.abs(errors) < 1.96 * np.sqrt(np.diag(found.covariance))
    for count in inside:
        assert_covers(count, draws, conservative=True)


def test_paper_reads_the_extremes() -> None:
    found = estimate_paper_ringdown(MeasuredSignal(TIME, ring(), 10.0), 0.0, 2.0)
    assert found.omega_d == pytest.approx(OMEGA, rel=5e-3)
    assert found.decay_rate == pytest.approx(RATE, rel=0.05)
    assert found.extremes_time.size >= 6


def test_noise_alone_is_refused() -> None:
    noise = 30.0 * np.random.default_rng(3).standard_normal(TIME.size)
    with pytest.raises(IdentificationError, match="no clean lock-up oscillation"):
        estimate_paper_ringdown(MeasuredSignal(TIME, 1800.0 + noise, 30.0), 0.0, 2.0)
    with pytest.raises(IdentificationError, match="no clean lock-up oscillation"):
        fit_ringdown(MeasuredSignal(TIME, 1800.0 + noise, 30.0), 0.0, 2.0, None)


def test_too_short_a_stretch_is_refused() -> None:
    with pytest.raises(IdentificationError, match=r"less than 0\.15 s"):
        fit_ringdown(MeasuredSignal(TIME, ring(), 1.0), 1.85, 2.0, None)


def test_stiffness_and_damping_invert_the_two_mass_formulas() -> None:
    k, c, J4, J5 = 1.76e5, 280.0, 36.18, 209.23
    J = J4 * J5 / (J4 + J5)
    rate = c / (2.0 * J)
    omega = np.sqrt(k / J - rate**2)
    assert compute_shaft_parameters(rate, float(omega), J4, J5) == pytest.approx([k, c])
    with pytest.raises(IdentificationError, match="both must be positive"):
        compute_shaft_parameters(rate, float(omega), J4, -1.0)
