# SPDX-License-Identifier: MIT
"""The profile is the least cost with a parameter held: a parabola where all acts linearly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.errors import IdentificationError, InputError
from drivetwin.estimation.analysis.profile_likelihood import compute_profile
from drivetwin.likelihood.gauss_newton import minimise
from tests.estimation.asked import by_the_paper, slowed, stepped


def test_of_a_parameter_that_acts_linearly_is_that_of_the_covariance() -> None:
    one = compute_profile(stepped(), "eta")
    half = 0.5 * (one.linear[1] - one.linear[0])
    assert one.interval == pytest.approx(one.linear, abs=0.1 * half)
    distance = (one.values - one.estimate) / (half / 1.96)
    assert one.rise == pytest.approx(distance**2, rel=0.15, abs=0.3)
    assert one.rise[np.argmin(np.abs(distance))] == 0.0


def test_slow_errors_widen_it_like_the_covariance() -> None:
    one = compute_profile(slowed(stepped()), "eta")
    half = 0.5 * (one.linear[1] - one.linear[0])
    assert half > 1.4 * 1.96 * (stepped().estimates["eta"].std_noise or 0.0)
    assert one.interval == pytest.approx(one.linear, abs=0.15 * half)


def test_is_the_least_cost_with_the_parameter_held() -> None:
    """Jo′ acts through the locks, not quite linearly; held by a hard prior Q is searched anew."""
    one = compute_profile(stepped(), "J_out")
    fit = stepped().evidence.likelihood
    assert fit is not None
    place = fit.point.names.index("J_out")
    for k in (1, -2):
        held = replace(
            fit.problem, prior=fit.problem.prior.fix_parameter(place, float(one.values[k]))
        )
        start = fit.point.values.copy()
        start[place] = one.values[k]
        found = minimise(held, fit.point.replace_values(start))
        assert found is not None
        data = found.normal.cost - held.prior.compute_prior_cost(found.point.values)
        least = data + fit.problem.prior.compute_prior_cost(found.point.values)
        rise = (least - fit.normal.cost) / max(fit.chi2, 1.0)
        assert one.rise[k] == pytest.approx(rise, abs=0.1)


def test_rises_to_both_sides_of_a_parameter_of_several_unknowns() -> None:
    one = compute_profile(stepped(), "J_prime_3")
    middle = int(np.argmin(one.rise))
    assert np.all(np.diff(one.rise[middle:]) > 0.0)
    assert np.all(np.diff(one.rise[: middle + 1]) < 0.0)
    assert one.interval[0] < one.estimate < one.interval[1]
    width = (one.interval[1] - one.interval[0]) / (one.linear[1] - one.linear[0])
    assert width == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize(("name", "match"), [("k_x", "choose one of eta"), ("P0.B2", "design")])
def test_refuses_what_does_not_move(name: str, match: str) -> None:
    with pytest.raises(InputError, match=match):
        compute_profile(stepped(), name)


def test_refuses_other_methods_and_says_why_a_fit_failed() -> None:
    with pytest.raises(IdentificationError, match="paper method"):
        compute_profile(by_the_paper(), "eta")
    evidence = replace(by_the_paper().evidence, gave_up="the work ran out")
    with pytest.raises(
        IdentificationError, match=r"fit of this log failed.+ the work ran"
    ) as reported:
        compute_profile(replace(by_the_paper(), evidence=evidence), "eta")
    assert "--method likelihood" not in reported.value.remedy
