# SPDX-License-Identifier: MIT
"""Search from fits of the lower gear, with and without backlash in the plant."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.estimation.mismatch_log import Rates, make_mismatch_log
from drivetwin.estimation.likelihood.selection.lower_gear_search import (
    fit_from_lower_gear,
    fit_with_backlash,
)
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.effects import EffectId
from drivetwin.vehicle.spec import PriorValue
from tests.estimation.likelihood.fixtures import bench, fitted, problem

SIZE = 0.04


def test_the_search_reaches_the_minimum_from_a_rough_start() -> None:
    made = bench()
    posed, start = problem(made, off=0.1)
    found = fit_from_lower_gear(posed, start, [made.signals.shift])
    assert found is not None
    known = fitted()
    assert found.problem.modes == known.problem.modes
    assert found.normal.cost < known.normal.cost + 1.0


def test_a_log_without_reversal_of_the_torque_has_no_backlash() -> None:
    made = bench()
    posed, start = problem(made)
    assert fit_with_backlash(posed, start, [made.signals.shift], [PriorValue(-3.5, 2.3)]) is None


@pytest.mark.statistical
@pytest.mark.short
def test_backlash_that_the_dual_clutch_cannot_follow_is_identified() -> None:
    made = make_mismatch_log(1049, EffectId.BACKLASH, SIZE, Rates.BUS)
    found = identify(made.log, made.card, detect_shifts(made.log, made.card))
    cause = found.evidence.cause
    assert cause is not None
    assert cause.group.effect is EffectId.BACKLASH
    assert cause.size == pytest.approx(SIZE, rel=0.1)
    truth = made.recorded.truth.parameters
    errors = [
        (one.value - truth[one.id]) / one.std_total
        for one in found.estimates.values()
        if one.verdict is Verdict.IDENTIFIED and one.value is not None and one.std_total
        if one.id in truth
    ]
    assert len(errors) >= 8
    assert np.max(np.abs(errors)) < 4.0
    largest = np.max(np.abs(made.recorded.trajectory.shaft_torque))
    gap = 2.0 * SIZE * largest / made.recorded.scenario.model.k_o
    assert found.estimates["backlash"].value == pytest.approx(gap, rel=0.15)
