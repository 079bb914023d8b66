# SPDX-License-Identifier: MIT
"""The other loss law is told where the log speaks for it, from one expansion of Q."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.estimates import build_estimates
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.optimize.multistart import fit_local
from drivetwin.estimation.likelihood.priors import build_problem
from drivetwin.estimation.likelihood.selection import candidates
from drivetwin.findings import render
from drivetwin.simulation.dual_clutch import LossLaw
from tests.estimation.likelihood.fixtures import truth_of
from tests.support.bench import Bench, Knowledge, record_bench
from tests.support.shared_results import shared

LAWS: tuple[LossLaw, ...] = ("paper", "dissipative")


@cache
def _made(law: LossLaw) -> Bench:
    """A log whose lock-up oscillation reverses the torque through the gears."""
    base = load_scenario("paper_steps")
    return record_bench(replace(base, model=replace(base.model, loss_law=law)), 0, Knowledge())


@shared
def _fit(true: LossLaw, card: LossLaw) -> LikelihoodFit:
    made = _made(true)
    found = fit_local(*build_problem([made.signals], [made.driveline], card, truth_of(made)))
    assert found is not None
    return found


def _said(made: Bench, fit: LikelihoodFit) -> list[str]:
    told = build_estimates(fit, [made.signals], [made.driveline], {}, EffectPriors())
    return [text for text in render(told.findings) if "loss_law" in text]


@pytest.mark.parametrize("true", LAWS)
def test_a_wrong_law_is_told_with_what_the_right_one_gives(true: LossLaw) -> None:
    wrong, right = _fit(true, candidates.OTHER[true]), _fit(true, true)
    (text,) = _said(_made(true), wrong)
    assert f"loss_law = '{true}'" in text
    assert "supports it" in text
    told = float(text.split("k_o = ")[1].split(" Nm")[0].replace("\u202f", ""))
    k = right.point.names.index("k_o")
    std = float(np.sqrt(right.covariance[k, k]))
    assert abs(told - right.point["k_o"]) < 0.5 * std
    assert abs(told - wrong.point["k_o"]) > 3.0 * std
    fall = float(text.split("(Q ")[1].rstrip(")."))
    # The expansion stops at second order, and weighs by the wrong law's response.
    assert fall == pytest.approx(right.normal.cost - wrong.normal.cost, rel=0.1)


@pytest.mark.parametrize("true", LAWS)
def test_of_a_right_law_nothing_is_said(true: LossLaw) -> None:
    assert _said(_made(true), _fit(true, true)) == []
