# SPDX-License-Identifier: MIT
"""Suggestions: the right experiment comes first, with the interval that it would really give."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin.errors import IdentificationError
from drivetwin.estimation.analysis.experiment_design import (
    compute_rankings,
    rank_experiments,
)
from drivetwin.estimation.analysis.profile_likelihood import get_likelihood_fit
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.fit import compute_variance_inflation
from drivetwin.estimation.likelihood.parametrization import LAW
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.estimation.result.suggestion import (
    Experiment,
)
from tests.estimation.asked import by_the_paper, slowed, stepped, still, uncertain_fills


def test_throttle_steps_tell_the_age_of_a_torque_that_stood_still() -> None:
    first = compute_rankings(still())[0]
    assert first.parameter == "te_delay"
    assert first.verdict is Verdict.NOT_IDENTIFIABLE
    assert first.half_width == np.inf
    best = first.prospects[0]
    assert best.experiment is Experiment.THROTTLE_STEPS
    assert best.verdict is Verdict.IDENTIFIED
    again = next(p for p in first.prospects if p.experiment is Experiment.AGAIN)
    assert again.verdict is Verdict.NOT_IDENTIFIABLE
    # The log with throttle steps that was then made: the promise held.
    std = stepped().estimates["te_delay"].std_noise
    assert std is not None
    assert best.half_width == pytest.approx(1.96 * std, rel=0.5)


def test_the_same_shift_again_halves_the_variance() -> None:
    """True of what no prior and no start state shares with the log."""
    found = still()
    (told,) = (s for s in compute_rankings(found) if s.parameter == "c_o")
    again = next(p for p in told.prospects if p.experiment is Experiment.AGAIN)
    assert again.half_width == pytest.approx(told.half_width / np.sqrt(2.0), rel=0.02)


def test_order_is_by_worth_and_least_known_are_told_too() -> None:
    found = compute_rankings(stepped())
    known = [n for n, e in stepped().estimates.items() if e.verdict is Verdict.IDENTIFIED]
    assert sorted(one.parameter for one in found) == sorted(known)
    for one in found:
        assert one.verdict is Verdict.IDENTIFIED
        widths = [p.half_width for p in one.prospects]
        assert widths == sorted(widths)
        assert widths[0] < one.half_width


def _followed_by_another_shift(found: Identification) -> Identification:
    """The identification as if its shift were followed by one to a gear 4, which K makes."""
    fit, signals = get_likelihood_fit(found)
    (term,), (shown,) = fit.problem.terms, signals
    first, record = term.structure, term.record
    oncoming = replace(
        first.driveline.oncoming, name="K", a=5.0, b=6.0, gear="4"
    )  # a brake of ratio 1.2
    held = {**first.driveline.couplings, "K": oncoming}
    driveline = replace(
        first.driveline, offgoing=first.driveline.oncoming, oncoming=oncoming, couplings=held
    )
    law = {f"K.{key}": fit.point[f"B3.{key}"] for key in LAW}
    fixed = {**first.fixed, **law, "K.P0": oncoming.P0.value, "K.drum": 0.0, "ratio_4": 1.2}
    renamed = {"B2": "B3", "B3": "K"}
    by_element: dict[str, Any] = {
        name: {renamed.get(key, key): each for key, each in one.items()}
        for name, one in vars(record).items()
        if isinstance(one, dict)
    }
    second = replace(
        term,
        structure=replace(first, driveline=driveline, fixed=fixed),
        record=replace(record, **by_element),
    )
    shift = replace(shown.shift, start_gear="3", end_gear="4", offgoing="B3", oncoming="K")
    problem = replace(fit.problem, terms=(term, second))
    normal = replace(
        fit.normal,
        residuals=2 * tuple(fit.normal.residuals),
        regressors=2 * tuple(fit.normal.regressors),
    )
    evidence = replace(
        found.evidence,
        likelihood=replace(fit, problem=problem, normal=normal),
        signals=(shown, replace(shown, shift=shift)),
    )
    return replace(found, evidence=evidence)


def test_of_several_shifts_an_element_is_told_by_one_that_moves_it() -> None:
    both = _followed_by_another_shift(uncertain_fills())
    (told,) = compute_rankings(replace(both, estimates={"P0.B2": both.estimates["P0.B2"]}))
    again = next(each for each in told.prospects if each.experiment is Experiment.AGAIN)
    assert again.shift == "2→3"
    assert again.half_width < 0.8 * told.half_width
    assert told.text.endswith("(shift 2→3)")


def test_what_sensors_decide_no_experiment_narrows() -> None:
    found = stepped()
    c_o = found.estimates["c_o"]
    assert c_o.std_noise is not None
    wide = replace(c_o, std_systematic=20.0 * c_o.std_noise)
    told = compute_rankings(replace(found, estimates={**found.estimates, "c_o": wide}))
    (one,) = (s for s in told if s.parameter == "c_o")
    assert not one.prospects
    assert "Calibrate the sensors" in one.text


def test_other_methods_have_no_information_to_compare() -> None:
    with pytest.raises(IdentificationError, match="likelihood"):
        compute_rankings(by_the_paper())


def test_an_identification_takes_up_what_would_tell_it_more() -> None:
    told = rank_experiments(still())
    assert [one.parameter for one in told.evidence.suggestions][:1] == ["te_delay"]
    assert rank_experiments(by_the_paper()) is by_the_paper()
    numbers = {one.parameter: one.number for one in told.evidence.suggestions}
    assert numbers["k_o"] == still().evidence.numbers["k_o"]


def test_an_experiment_has_the_slow_errors_of_the_log() -> None:
    """Else the same shift again would seem to narrow what the sensors' filters have widened."""
    half, power = [], []
    for found in (still(), slowed(still())):
        (told,) = (one for one in compute_rankings(found) if one.parameter == "c_o")
        half.append(next(p for p in told.prospects if p.experiment is Experiment.AGAIN).half_width)
        fit, _ = get_likelihood_fit(found)
        power.append(
            compute_variance_inflation(
                fit, np.eye(len(fit.point.names))[[fit.point.names.index("c_o")]]
            )
        )
    assert power[1] > 2.0 * power[0]
    assert half[1] / half[0] == pytest.approx(np.sqrt(power[1] / power[0]), rel=1e-6)
