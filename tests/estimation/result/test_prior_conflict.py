# SPDX-License-Identifier: MIT
"""Design values against what the log alone tells, by normal distributions in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.estimation.result.prior_conflict import (
    apply_contradictions,
    check_efficiency_limit,
    find_contradictions,
)
from drivetwin.findings import render
from drivetwin.vehicle.spec import PriorValue
from tests.support.arrays import FloatArray

IDS = ("J_out", "J_prime_2", "Tv_over_if")
LOG = np.array([1.2, 14.3, 1800.0])
"""What the log alone tells; J′ follows Jo′, T_v/i_f does not."""
_ROOT = np.array([[0.12, 0.0, 0.0], [0.06, 0.01, 0.0], [0.0, 0.0, 0.3]])
COVARIANCE = _ROOT @ _ROOT.T
STD = float(np.sqrt(COVARIANCE[0, 0]))


def _posterior(design: PriorValue) -> tuple[FloatArray, FloatArray]:
    """The estimates with the card's Jo′ in them."""
    information = np.linalg.inv(COVARIANCE)
    pull = information @ LOG
    information[0, 0] += design.std**-2
    pull[0] += design.value / design.std**2
    covariance = np.linalg.inv(information)
    return covariance @ pull, covariance


def _found(design: PriorValue, sensors: float = 0.0) -> Any:
    values, covariance = _posterior(design)
    total = covariance + np.diag([sensors**2, 0.0, 0.0])
    return find_contradictions(IDS, values, covariance, {"J_out": design}, total)


@pytest.mark.parametrize("std", [0.02, 0.1, 0.3])
@pytest.mark.parametrize(("apart", "is_reported"), [(2.9, False), (7.0, True)])
def test_a_contradiction_is_the_distance_from_what_the_log_alone_tells(
    std: float, apart: float, is_reported: bool
) -> None:
    design = PriorValue(LOG[0] + apart * float(np.hypot(std, STD)), std)
    moved = _posterior(design)[0][0] - design.value
    found = _found(design)
    assert bool(found) == (is_reported and abs(moved) > std)
    for one in found:
        assert one.apart == pytest.approx(apart, rel=1e-6)
        assert (one.log.value, one.log.std) == pytest.approx((LOG[0], STD), rel=1e-6)
        assert list(one.without) == list(IDS)
        assert list(one.without.values()) == pytest.approx(LOG, rel=1e-9)
        assert "1.2" in one.finding.text


def test_sensors_that_may_be_off_explain_as_much() -> None:
    design = PriorValue(LOG[0] + 4.0 * float(np.hypot(0.1, STD)), 0.1)
    assert _found(design)
    assert not _found(design, sensors=0.1)


def test_an_estimate_that_is_off_the_card_although_it_is_as_wide_is_told() -> None:
    design = PriorValue(1.35, 0.135)
    values, covariance = np.array([29.9]), np.array([[0.2**2]])
    (found,) = find_contradictions(("J_out",), values, covariance, {"J_out": design}, covariance)
    assert found.apart == pytest.approx((29.9 - 1.35) / 0.2)
    wide = np.array([[20.0**2]])
    assert find_contradictions(("J_out",), values, wide, {"J_out": design}, wide) == ()


def test_what_rests_on_a_contradicted_value_is_not_identified() -> None:
    design = PriorValue(2.4, 0.1)
    values, covariance = _posterior(design)
    estimates = {
        name: Estimate(name, value, std, Verdict.IDENTIFIED, "likelihood")
        for name, value, std in zip(IDS, values, np.sqrt(np.diag(covariance)), strict=True)
    }
    judged = apply_contradictions(estimates, _found(design), "likelihood with design prior")
    assert judged["J_out"].verdict is judged["J_prime_2"].verdict is Verdict.WEAK
    assert "the log gives 14.300 kg·m²" in judged["J_prime_2"].reason
    assert judged["Tv_over_if"] == estimates["Tv_over_if"]


def test_an_exact_value_and_one_that_physics_excludes_are_judged_elsewhere() -> None:
    nothing = np.array([[1e-4]])
    for value, std in ((1.2, 0.0), (-0.2, 0.1)):
        design = {"J_out": PriorValue(2.4, std)}
        values = np.array([value])
        assert find_contradictions(("J_out",), values, nothing, design, nothing) == ()


@pytest.mark.parametrize(("eta", "std", "is_reported"), [(1.06, 2e-4, True), (1.01, 0.01, False)])
def test_an_efficiency_above_one_is_not_identified(
    eta: float, std: float, is_reported: bool
) -> None:
    estimates = {"eta": Estimate("eta", eta, std, Verdict.IDENTIFIED, "likelihood")}
    found, findings = check_efficiency_limit(estimates, "dissipative")
    assert found["eta"].verdict is (Verdict.WEAK if is_reported else Verdict.IDENTIFIED)
    assert [("1.06" in text, "overrun" in text) for text in render(findings)] == [
        (True, False)
    ] * is_reported
    by_paper = check_efficiency_limit(estimates, "paper")[1]
    assert ["overrun" in one.remedy for one in by_paper] == [True] * is_reported
    assert check_efficiency_limit({}, "paper") == ({}, ())
