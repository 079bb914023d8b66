# SPDX-License-Identifier: MIT
"""What is told where a load that grows with speed hardly shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.optimize.multistart import fit_local
from drivetwin.estimation.likelihood.priors import build_problem
from drivetwin.estimation.likelihood.selection.aero_load import (
    _moments,
    average_with_boundary_model,
)
from drivetwin.estimation.linear.load_balance import AERO
from drivetwin.estimation.optimize.objective import ParameterVector
from tests.estimation.likelihood.fixtures import bench, truth_of
from tests.support.coverage import FULL, assert_covers, vary_draws
from tests.support.shared_results import shared

MOVED = "J_vehicle"


@shared
def _fits() -> tuple[LikelihoodFit, LikelihoodFit]:
    """Fits of a log of constant load: without the growing part, and with it."""
    made = bench()
    law, truth = made.run.scenario.model.loss_law, truth_of(made)
    found = []
    for guess in (truth, truth | {AERO: 1.0}):
        posed, start = build_problem([made.signals], [made.driveline], law, guess)
        fit = fit_local(posed, start)
        assert fit is not None
        found.append(fit)
    return found[0], found[1]


def _seen(size: float, own: float) -> tuple[LikelihoodFit, LikelihoodFit]:
    """Fits that see a growth of `size` standard deviations; what `MOVED` then has of its own is
    `own` of the one without it."""
    narrow, wide = _fits()
    k, i = wide.point.names.index(AERO), wide.point.names.index(MOVED)
    covariance = np.diag(np.ones(len(wide.point.names)))
    covariance[i, i], covariance[i, k], covariance[k, i] = 1.0 + own**2, 1.0, 1.0
    values = wide.point.values.copy()
    values[k] = size
    wide = replace(wide, point=wide.point.replace_values(values), covariance=covariance)
    within = np.diag(np.ones(len(narrow.point.names)))
    j = narrow.point.names.index(MOVED)
    within[j, j] = own**2
    return replace(narrow, covariance=within), wide


@pytest.mark.parametrize("size", [-40.0, -2.0, 0.0, 0.7, 2.5, 8.0])
def test_moments_are_those_of_none_or_a_normal_distribution_above_none(size: float) -> None:
    x = np.linspace(0.0, max(size, 0.0) + 10.0, 400_001)
    density = np.exp(-0.5 * ((x - size) ** 2 - min(size, 0.0) ** 2))
    density /= np.trapezoid(density, x)
    weight = 1.0 / (1.0 + np.exp(-0.5 * max(size, 0.0) ** 2))
    first, second = (weight * np.trapezoid(x**n * density, x) for n in (1, 2))
    mean, variance = _moments(size)
    assert mean == pytest.approx(first, rel=1e-4)
    assert variance == pytest.approx(second - first**2, rel=1e-3)


@vary_draws()
@pytest.mark.parametrize("own", [0.2, 1.0])
@pytest.mark.parametrize("size", [0.0, 0.5, 1.0, 2.0, 3.0])
def test_intervals_without_the_growing_part_cover_a_growth_that_hardly_shows(
    size: float, own: float, draws: int, request: pytest.FixtureRequest
) -> None:
    if (size, own, draws) == (2.0, 0.2, FULL):
        reason = "measured: 90.8 % of 1000 intervals cover"
        request.applymarker(pytest.mark.xfail(reason=reason, strict=True))
    rng = np.random.default_rng(7)
    j = _fits()[0].point.names.index(MOVED)
    truth = _fits()[0].mean[MOVED] + size
    inside = alone = 0
    for noise, error in rng.standard_normal((draws, 2)):
        narrow, wide = _seen(size + noise, own)
        values = narrow.mean.values.copy()
        values[j] += own * error
        narrow = replace(narrow, mean=narrow.mean.replace_values(values))
        if size + noise < 0.0:
            wide = _at_bound(wide, size + noise)
        told = average_with_boundary_model(narrow, wide)
        inside += abs(told.mean[MOVED] - truth) < 1.96 * np.sqrt(told.covariance[j, j])
        alone += abs(narrow.mean[MOVED] - truth) < 1.96 * own
    assert_covers(inside, draws, conservative=True)
    assert alone < inside or size == 0.0


def _at_bound(wide: LikelihoodFit, size: float) -> LikelihoodFit:
    """The fit as a search leaves it whose minimum lies at `size` below none."""
    k = wide.point.names.index(AERO)
    inside, away = wide.point.values.copy(), np.zeros(wide.point.values.size)
    inside[k], away[k] = 0.0, size
    information = np.asarray(np.linalg.inv(wide.covariance), dtype=float)
    normal = replace(wide.normal, information=information, gradient=-information @ away)
    return replace(wide, point=ParameterVector(wide.point.names, inside), normal=normal)


def test_a_log_that_would_show_growth_is_told_as_it_was() -> None:
    narrow, wide = _fits()
    told = average_with_boundary_model(narrow, wide)
    std = np.sqrt(np.diag(narrow.covariance))
    assert np.sqrt(np.diag(told.covariance)) == pytest.approx(std, rel=0.1)
    assert np.all(np.abs(told.mean.values - narrow.mean.values) < std)
