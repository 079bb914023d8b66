# SPDX-License-Identifier: MIT
"""Suggestions: the right experiment comes first, with the interval that it would really give."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin.estimation.analysis.experiment_design import rank_experiments
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Verdict
from tests.estimation.asked import by_the_paper, slowed, stepped, still

AGAIN, STEPS = "again", "throttle_steps"


def _rank(found: Identification) -> Any:
    return rank_experiments(found).evidence.suggestions


def _get_again(found: Identification, name: str) -> tuple[Any, Any]:
    """Return the ranking of a parameter, and its prospect by the same shift again."""
    (ranked,) = (one for one in _rank(found) if one.parameter == name)
    return ranked, next(p for p in ranked.prospects if p.experiment.name.lower() == AGAIN)


def test_throttle_steps_tell_the_age_of_a_torque_that_stood_still() -> None:
    first = _rank(still())[0]
    assert first.parameter == "te_delay"
    assert first.verdict is Verdict.NOT_IDENTIFIABLE
    assert first.half_width == np.inf
    best = first.prospects[0]
    assert best.experiment.name.lower() == STEPS
    assert best.verdict is Verdict.IDENTIFIED
    assert _get_again(still(), "te_delay")[1].verdict is Verdict.NOT_IDENTIFIABLE
    # The log with throttle steps that was then made: the promise held.
    std = stepped().estimates["te_delay"].std_noise
    assert std is not None
    assert best.half_width == pytest.approx(1.96 * std, rel=0.5)


def test_the_same_shift_again_halves_the_variance() -> None:
    """True of what no prior and no start state shares with the log."""
    ranked, again = _get_again(still(), "c_o")
    assert again.half_width == pytest.approx(ranked.half_width / np.sqrt(2.0), rel=0.02)


def test_order_is_by_worth_and_least_known_are_told_too() -> None:
    found = _rank(stepped())
    known = [n for n, e in stepped().estimates.items() if e.verdict is Verdict.IDENTIFIED]
    assert sorted(one.parameter for one in found) == sorted(known)
    for one in found:
        assert one.verdict is Verdict.IDENTIFIED
        widths = [p.half_width for p in one.prospects]
        assert widths == sorted(widths)
        assert widths[0] < one.half_width


def test_no_experiment_narrows_an_interval_that_effects_decide() -> None:
    found = stepped()
    c_o = found.estimates["c_o"]
    assert c_o.std_noise is not None
    wide = replace(c_o, std_systematic=20.0 * c_o.std_noise)
    ranked = _rank(replace(found, estimates={**found.estimates, "c_o": wide}))
    (one,) = (s for s in ranked if s.parameter == "c_o")
    assert not one.prospects
    assert "record a manoeuvre in which" in one.text


def test_an_identification_takes_up_what_would_tell_it_more() -> None:
    ranked = rank_experiments(still())
    assert [one.parameter for one in ranked.evidence.suggestions][:1] == ["te_delay"]
    assert rank_experiments(by_the_paper()) is by_the_paper()
    numbers = {one.parameter: one.number for one in ranked.evidence.suggestions}
    assert numbers["k_o"] == still().evidence.numbers["k_o"]


def test_an_experiment_has_the_slow_errors_of_the_log() -> None:
    """Else the same shift again would seem to narrow what the sensors' filters have widened."""
    half, std = [], []
    for found in (still(), slowed(still())):
        fit = found.evidence.likelihood
        assert fit is not None
        place = fit.point.names.index("c_o")
        std.append(np.sqrt(fit.covariance[place, place]))
        half.append(_get_again(found, "c_o")[1].half_width)
    assert std[1] > 1.4 * std[0]
    assert half[1] / half[0] == pytest.approx(std[1] / std[0], rel=0.05)
