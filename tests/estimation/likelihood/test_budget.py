# SPDX-License-Identifier: MIT
"""A search ends where its work is done, with what it has found by then."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.errors import IdentificationError
from drivetwin.estimation.likelihood.budget import (
    EXPANSION,
    RUN,
    BudgetExceeded,
    charge,
    limit_evaluations,
)
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.optimize.multistart import find_staged_start
from drivetwin.estimation.likelihood.selection import select_model as selection_module
from drivetwin.estimation.likelihood.selection.select_model import select_model
from tests.estimation.likelihood.fixtures import bench, problem, truth_of


def _chosen(seed: int = 0) -> LikelihoodFit:
    made = bench(seed)
    law = made.run.scenario.model.loss_law
    return select_model([made.signals], [made.driveline], law, truth_of(made), EffectPriors())[0]


def test_work_is_counted_within_its_block_alone() -> None:
    charge(1e9)
    with limit_evaluations(3.0):
        charge(2.0)
        with limit_evaluations(1.0):
            charge(1.0)
        charge(1.0)
        with pytest.raises(BudgetExceeded, match="did not converge within"):
            charge(RUN)
    charge(1e9)


def test_runs_and_expansions_are_work() -> None:
    posed, start = problem(bench())
    with limit_evaluations(2.0 * RUN + EXPANSION):
        posed.cost(start)
        posed.normal(start)
        posed.cost(start)
        with pytest.raises(BudgetExceeded):
            posed.cost(start)


def test_a_search_that_has_no_work_to_do_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        selection_module, "SELECTION", replace(selection_module.SELECTION, max_work=2.0 * EXPANSION)
    )
    with pytest.raises(IdentificationError, match="did not converge within"):
        _chosen()


def test_a_stage_far_from_the_measurement_is_the_last() -> None:
    made = bench()
    posed, start = problem(made)
    heavy = start.replace_values(start.values.copy())
    held = posed.prior
    for k, name in enumerate(start.names):
        if name == "J_vehicle":
            heavy.values[k] *= 5.0
            held = held.fix_parameter(k, heavy.values[k])
    # The lower gear alone shows that a vehicle of five times the mass is wrong.
    with limit_evaluations(24.0 * EXPANSION + 100.0 * RUN):
        wrong = type(posed)(posed.terms, held, posed.lower, posed.upper)
        assert find_staged_start(wrong, heavy, [made.signals.shift]) is None
