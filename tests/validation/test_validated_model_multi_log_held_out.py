# SPDX-License-Identifier: MIT
"""Shifts held out of the fit: predicted, and judged against what their noise allows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.result.validation import Outcome
from drivetwin.findings import render
from drivetwin.validation.validated_model import predict_held_shifts
from tests.estimation.asked import by_the_paper
from tests.estimation.multi_log.fixtures import LOADS, card, pair, scenario, source, together


def _held() -> Any:
    (one,) = together().found.evidence.held_out
    return one


def test_a_right_model_predicts_as_well_as_noise_allows() -> None:
    one = _held()
    assert one.outcome is Outcome.ALLOWED
    assert one.validation is not None
    fitted = together().found.fit
    for signal, phases in one.validation.fit.items():
        assert phases["all"].fit_percent > fitted[signal]["all"].fit_percent - 2.0
        assert 0.0 < one.bounds[signal].usual < one.bounds[signal].largest
        assert phases["all"].rmse > 0.8 * one.bounds[signal].usual, "the noise of the sensor"


def test_load_and_age_of_a_log_that_was_not_fitted_are_told_beside() -> None:
    own = _held().own
    assert set(own) == {"Tv_over_if", "te_delay"}
    load = own["Tv_over_if"]
    assert load.value == pytest.approx(LOADS[0], abs=5.0 * (load.std_noise or 0.0))
    assert "before the shift" in load.method


def test_a_vehicle_that_changed_is_predicted_worse_than_noise() -> None:
    heavy = source(scenario(payload=1.1), 26)
    (one,) = predict_held_shifts(together().found, card(), heavy.log, heavy.shifts.shifts, 3)
    assert one.outcome is Outcome.WORSE
    assert Outcome.WORSE in {one.get_signal_outcome(signal) for signal in one.bounds}


def test_one_with_wrong_friction_is_predicted_worse_than_noise() -> None:
    found, log = together().found, pair()[0]
    friction = {
        name: replace(curve, stribeck=replace(curve.stribeck, mu_c=1.1 * curve.stribeck.mu_c))
        for name, curve in found.friction.items()
        if curve.stribeck is not None
    }
    wrong = replace(found, friction=friction)
    (one,) = predict_held_shifts(wrong, card(), log.log, log.shifts.shifts, 1)
    assert one.outcome is Outcome.WORSE


def test_what_cannot_be_predicted_says_why() -> None:
    log = pair()[0]
    channels = {k: v for k, v in log.log.channels.items() if k != "engine_torque"}
    blind = ShiftLog(channels, "blind.csv", "x")
    (one,) = predict_held_shifts(together().found, card(), blind, log.shifts.shifts, 3)
    assert one.outcome is Outcome.NOT_PREDICTED
    assert one.validation is None
    assert "engine_torque" in render(one.findings)[0]
    assert one.name == "blind.csv, shift 2→3"


def test_another_method_predicts_its_own_log_without_a_judgement() -> None:
    log = pair()[0]
    found = by_the_paper()
    (known,) = predict_held_shifts(found, card(), log.log, log.shifts.shifts, 0)
    assert known.outcome is Outcome.NOT_JUDGED
    (foreign,) = predict_held_shifts(found, card(), log.log, log.shifts.shifts, 1)
    assert foreign.outcome is Outcome.NOT_PREDICTED
    assert "likelihood" in render(foreign.findings)[0]
