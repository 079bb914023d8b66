# SPDX-License-Identifier: MIT
"""Experiments in `result.json`."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.estimation.analysis.experiment_design import compute_rankings
from drivetwin.files.result_file import ResultFile
from tests.estimation.asked import still


def test_what_would_narrow_an_open_parameter_stands_in_the_result() -> None:
    found = still()
    reported = compute_rankings(found)
    made = ResultFile.from_result(
        replace(found, evidence=replace(found.evidence, suggestions=reported))
    )
    assert [one.parameter for one in made.suggestions] == [one.parameter for one in reported]
    (age,) = (one for one in made.suggestions if one.parameter == "te_delay")
    assert age.half_width is None
    assert age.unit == "s"
    assert age.experiments[0].half_width == pytest.approx(
        next(one for one in reported if one.parameter == "te_delay").prospects[0].half_width
    )
    assert '"suggestions"' in made.to_json()


def test_a_result_without_them_has_none() -> None:
    assert ResultFile.from_result(still()).suggestions == []
