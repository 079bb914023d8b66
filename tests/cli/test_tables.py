# SPDX-License-Identifier: MIT
"""Tables of the commands: what no experiment narrows is listed once for each reason."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.cli.tables import build_suggestion_table, list_limits
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.estimation.result.suggestion import (
    CardNumber,
    CardNumberKind,
    ExpectedPrecision,
    Experiment,
    ExperimentRanking,
)


def test_what_no_experiment_narrows_is_listed_once_for_each_reason() -> None:
    best = ExpectedPrecision(Experiment.COAST_DOWN, 1, 0.1, Verdict.IDENTIFIED)
    limit = "the gain of the torque sensor"
    suggestions = [
        ExperimentRanking("J_out", Verdict.WEAK, 0.3, (best,)),
        ExperimentRanking("eta", Verdict.IDENTIFIED, 0.02, (), limit),
        ExperimentRanking("k_o", Verdict.IDENTIFIED, 2e3, (), limit),
    ]
    estimates = {
        one.parameter: Estimate(one.parameter, 1.0, 0.1, one.verdict, "likelihood")
        for one in suggestions
    }
    assert build_suggestion_table(suggestions, estimates).row_count == 1
    number = CardNumber(CardNumberKind.EFFECT, "input_drag", share=0.5)
    known = [replace(one, number=number) for one in suggestions]
    table = build_suggestion_table(known, estimates)
    assert table.row_count == 3
    assert list(table.columns[4].cells)[1] == "input_drag"
    assert list_limits(suggestions) == [f"eta, k_o: {limit}"]
