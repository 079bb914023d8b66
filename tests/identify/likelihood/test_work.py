# SPDX-License-Identifier: MIT
"""A search ends where its work is done, with what it has found by then."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.errors import IdentificationError
from drivetwin.identify.likelihood import variants
from drivetwin.identify.likelihood.fit import LikelihoodFit, checked, nearest
from drivetwin.identify.likelihood.output_error import staged
from drivetwin.identify.likelihood.unknowns import AERO
from drivetwin.identify.likelihood.variants import choose
from drivetwin.identify.likelihood.work import EXPANSION, RUN, OutOfWork, at_most, spend
from tests.identify.likelihood.made import bench, fitted, problem, truth_of


def _chosen(seed: int = 0) -> LikelihoodFit:
    made = bench(seed)
    law = made.run.scenario.model.loss_law
    return choose([made.signals], [made.driveline], law, truth_of(made))[0]


def test_work_is_counted_within_its_block_alone() -> None:
    spend(1e9)
    with at_most(3.0):
        spend(2.0)
        with at_most(1.0):
            spend(1.0)
        spend(1.0)
        with pytest.raises(OutOfWork, match="without a plausible minimum"):
            spend(RUN)
    spend(1e9)


def test_runs_and_expansions_are_work() -> None:
    posed, start = problem(bench())
    with at_most(2.0 * RUN + EXPANSION):
        posed.cost(start)
        posed.normal(start)
        posed.cost(start)
        with pytest.raises(OutOfWork):
            posed.cost(start)


def test_a_search_that_has_no_work_to_do_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        variants, "SELECTION", replace(variants.SELECTION, max_work=2.0 * EXPANSION)
    )
    with pytest.raises(IdentificationError, match="given up without a plausible minimum"):
        _chosen()


def test_what_a_wider_model_found_stands_where_there_is_no_work_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(
        variants, "SELECTION", replace(variants.SELECTION, max_restricted_work=2.0 * EXPANSION)
    )
    # In this log's noise the load grows a little; where it ends at zero there is nothing to search.
    assert _chosen(seed=1).point[AERO] > 0.0


def test_a_fit_that_is_known_outlives_the_work_of_checking_it() -> None:
    made, found = bench(), fitted()
    posed, start = problem(made)
    with at_most(EXPANSION):
        assert checked(found, posed, start, [made.signals.shift]) is found
    again = checked(found, posed, start, [made.signals.shift])
    assert again.chi2 == pytest.approx(found.chi2, abs=1e-3)


def test_a_stage_far_from_the_measurement_is_the_last() -> None:
    made = bench()
    posed, start = problem(made)
    heavy = start.moved(start.values.copy())
    held = posed.prior
    for k, name in enumerate(start.names):
        if name == "J_vehicle":
            heavy.values[k] *= 5.0
            held = held.held(k, heavy.values[k])
    # The lower gear alone shows that a vehicle of five times the mass is wrong.
    with at_most(21.0 * EXPANSION + 100.0 * RUN):
        wrong = type(posed)(posed.parts, held, posed.lower, posed.upper)
        assert staged(wrong, heavy, [made.signals.shift]) is None


def test_a_search_above_what_is_asked_for_ends_soon() -> None:
    posed, start = problem(bench(), off=0.02)
    with at_most(12.0 * EXPANSION):
        assert nearest(posed, start, most=0.5) is None
