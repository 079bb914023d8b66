# SPDX-License-Identifier: MIT
"""The mixed-effects model: closed forms, scale, and intervals that cover a known truth."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.fleet.mixed import Observations, fit_mixed_model
from tests.support.arrays import FloatArray
from tests.support.coverage import COARSE, assert_covers, vary_draws
from tests.support.shared_results import shared

LEVEL, DRIFT, SPREAD, OWN_DRIFT = 0.118, -4e-3, 4e-3, 1e-3


def deviations(seed: int, units: int = 25) -> FloatArray:
    """True level and drift (units, 2) of each unit, less the fleet's."""
    return np.random.default_rng(1000 + seed).normal(0.0, [SPREAD, OWN_DRIFT], (units, 2))


def made(seed: int, logs: int = 200, units: int = 25, factor: float = 1.0) -> Observations:
    """Logs of known truth that scatter `factor` times as much as they state."""
    draws = np.random.default_rng(seed)
    unit = np.arange(logs) % units
    reading = draws.uniform(-1.0, 1.0, logs)
    own = deviations(seed, units)[unit]
    std = draws.uniform(1e-3, 2e-3, logs)
    y = LEVEL + own[:, 0] + (DRIFT + own[:, 1]) * reading
    x = np.column_stack([np.ones(logs), reading])
    return Observations(y + factor * std * draws.standard_normal(logs), std, unit, x, x)


@shared
def fits(draws: int) -> list[Any]:
    """Fits of many fleets."""
    return [fit_mixed_model(made(seed)) for seed in range(draws)]


@vary_draws()
def test_intervals_cover_the_truth(draws: int) -> None:
    for place, true in enumerate((LEVEL, DRIFT)):
        assert_covers(sum(abs(f.beta[place] - true) < f.half[place] for f in fits(draws)), draws)
    for place, true in enumerate((SPREAD, OWN_DRIFT)):
        inside = [f.sigma_ci[place, 0] <= true <= f.sigma_ci[place, 1] for f in fits(draws)]
        assert_covers(sum(inside), draws)


def test_estimates_are_right_on_average() -> None:
    betas = np.array([f.beta for f in fits(COARSE)])
    error = betas.std(axis=0) / np.sqrt(COARSE)
    assert np.all(np.abs(betas.mean(axis=0) - [LEVEL, DRIFT]) < 4.0 * error)
    assert np.mean([f.sigma[0] for f in fits(COARSE)]) == pytest.approx(SPREAD, rel=0.1)
    stated = np.mean([f.half for f in fits(COARSE)], axis=0) / 2.05
    assert betas.std(axis=0) == pytest.approx(stated, rel=0.35)


@vary_draws()
def test_units_are_within_their_errors(draws: int) -> None:
    """One unit of each fleet counts, as the level is common to the units of a fleet."""
    own = np.array([deviations(seed)[0, 0] for seed in range(draws)])
    away = np.array([f.deviation[0, 0] for f in fits(draws)]) - own
    std = np.array([f.deviation_std[0, 0] for f in fits(draws)])
    assert_covers(int(np.count_nonzero(np.abs(away) < 1.96 * std)), draws)


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
def test_the_scatter_of_logs_is_found(factor: float) -> None:
    found = fit_mixed_model(made(5, 1000, 40, factor), intervals=False)
    assert np.isnan(found.sigma_ci).all()
    assert found.excess == pytest.approx(factor, rel=0.1)


def test_without_units_it_is_weighted_least_squares() -> None:
    base = made(1)
    noise = 0.5 * base.std * np.random.default_rng(0).standard_normal(200)
    seen = replace(base, y=LEVEL + noise, unit=np.zeros(200, dtype=int), z=base.z[:, :0])
    found = fit_mixed_model(seen)
    root = 1.0 / seen.std
    exact, *_ = np.linalg.lstsq(seen.x * root[:, None], seen.y * root, rcond=None)
    assert found.beta == pytest.approx(exact, rel=1e-9)
    assert found.sigma.size == 0


def test_equal_units_have_no_spread() -> None:
    seen = made(2, 300, 30)
    draws = np.random.default_rng(0)
    found = fit_mixed_model(replace(seen, y=LEVEL + seen.std * draws.standard_normal(300)))
    assert found.sigma[0] < 3e-4
    assert found.sigma_ci[0, 0] == 0.0


@settings(max_examples=10)
@given(st.floats(1e-6, 1e8), st.floats(-10.0, 10.0))
def test_another_unit_of_measure_changes_nothing(scale: float, shift: float) -> None:
    seen, base = made(4, 120, 12), fit_mixed_model(made(4, 120, 12), intervals=False)
    moved = replace(seen, y=scale * (seen.y + shift), std=scale * seen.std)
    found = fit_mixed_model(moved, intervals=False)
    assert found.beta[0] / scale - shift == pytest.approx(base.beta[0], abs=1e-5)
    assert found.sigma / scale == pytest.approx(base.sigma, rel=2e-2, abs=1e-5)


def test_one_log_of_each_unit_counts_as_it_states() -> None:
    inside, spreads = 0, []
    for seed in range(COARSE):
        draws = np.random.default_rng(2000 + seed)
        ones = np.ones((12, 1))
        y = LEVEL + draws.normal(0.0, np.hypot(SPREAD, 1e-3), 12)
        fit = fit_mixed_model(Observations(y, np.full(12, 1e-3), np.arange(12), ones, ones))
        assert fit.excess == pytest.approx(1.0)
        inside += fit.sigma_ci[0, 0] <= SPREAD <= fit.sigma_ci[0, 1]
        spreads.append(fit.sigma[0])
    assert_covers(inside, COARSE)
    assert np.mean(spreads) == pytest.approx(SPREAD, rel=0.1)
