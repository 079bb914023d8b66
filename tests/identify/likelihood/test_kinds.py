# SPDX-License-Identifier: MIT
"""What is told of the unknowns where a log hardly tells what kind of signals it holds."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from benchmarks.estimation.bench import realise
from drivetwin.dyno.scenarios import paper_steps, throttle_steps
from drivetwin.identify.likelihood.fit import LikelihoodFit, nearest
from drivetwin.identify.likelihood.kinds import averaged, with_kinds
from drivetwin.identify.likelihood.problem import Problem
from tests.identify.likelihood.made import ROUGH, problem

MEANS = frozenset({"output_torque"})
UNDECIDED = 78
"""Seed of a noise whose Q is lower by 4.7 of 26,847 with means of the output torque, which are
none."""


@cache
def _posed() -> Problem:
    return problem(realise(throttle_steps(), UNDECIDED, ROUGH))[0]


@cache
def _fit(kinds: frozenset[str]) -> LikelihoodFit:
    _, start = problem(realise(throttle_steps(), UNDECIDED, ROUGH))
    found = nearest(_posed().of_kinds(kinds), start)
    assert found is not None
    return found


def _age(fit: LikelihoodFit) -> tuple[float, float]:
    """The age told and its standard deviation [s]."""
    k = fit.point.names.index("te_delay")
    return fit.mean["te_delay"], float(np.sqrt(fit.covariance[k, k]))


def test_two_kinds_that_the_log_hardly_tells_are_both_within_the_interval() -> None:
    ages = [_fit(kinds).point["te_delay"] for kinds in (frozenset[str](), MEANS)]
    sharp = _age(_fit(MEANS))[1]
    assert abs(ages[0] - ages[1]) > 5.0 * sharp
    told, doubts = averaged(_posed(), _fit(MEANS))
    value, std = _age(told)
    assert all(abs(age - value) < 1.96 * std for age in ages)
    truth = realise(throttle_steps(), UNDECIDED, ROUGH).truth["te_delay"]
    assert abs(truth - value) < 1.96 * std
    assert len(doubts) == 1
    assert doubts[0].endswith("output torque")


def test_it_does_not_matter_from_which_kind_one_comes() -> None:
    one, other = (
        _age(averaged(_posed(), with_kinds(_posed(), _fit(kinds)))[0])
        for kinds in (frozenset[str](), MEANS)
    )
    assert one[0] == pytest.approx(other[0], abs=0.1 * one[1])
    assert one[1] == pytest.approx(other[1], rel=0.1)


def test_a_clear_log_is_left_as_it_is() -> None:
    posed, start = problem(realise(paper_steps(), 0, ROUGH))
    fit = nearest(posed, start)
    assert fit is not None
    told, doubts = averaged(posed, fit)
    std = np.sqrt(np.diag(fit.covariance))
    assert doubts == []
    assert np.all(np.abs(told.mean.values - fit.point.values) < 1e-3 * std)
    assert np.diag(told.covariance) == pytest.approx(np.diag(fit.covariance), rel=1e-3)


def test_the_expansion_foretells_the_other_minimum() -> None:
    here, there = _fit(MEANS), _fit(frozenset[str]())
    told, _ = averaged(_posed(), here)
    added = told.covariance - here.covariance
    k = here.point.names.index("te_delay")
    apart = there.point["te_delay"] - here.point["te_delay"]
    share = (told.mean["te_delay"] - here.point["te_delay"]) / apart
    assert 0.0 < share < 1.0
    assert added[k, k] >= 0.99 * share * (1.0 - share) * apart**2
    assert np.all(np.linalg.eigvalsh(added) > -1e-9 * np.max(np.linalg.eigvalsh(added)))
