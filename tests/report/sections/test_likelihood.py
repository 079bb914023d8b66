# SPDX-License-Identifier: MIT
"""The likelihood's evidence: tests of what is left, and the sensors' sensitivity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.estimation.identification import Identification, StageResults
from drivetwin.estimation.likelihood.effects.correction import keep_fit
from drivetwin.estimation.likelihood.uncertainty.friction_bands import build_friction_curves
from drivetwin.report.blocks import FigureBlock, TableBlock, Tone
from drivetwin.report.html import render_report
from drivetwin.report.sections.likelihood import (
    build_likelihood_sections,
    count_consistent_residuals,
)
from tests.estimation.likelihood.fixtures import bench, fitted
from tests.report.sample import identification, log
from tests.support.shared_results import shared


@shared
def found() -> Identification:
    fit, signals = fitted(), bench().signals
    return replace(
        identification(),
        shifts=(signals.shift,),
        friction=build_friction_curves(fit, {}, keep_fit(fit)),
        evidence=StageResults(likelihood=fit, signals=(signals,)),
    )


def test_other_methods_have_no_such_sections() -> None:
    assert build_likelihood_sections(identification()) == []


def test_what_is_left_of_a_right_model_is_judged_good() -> None:
    fit, _ = build_likelihood_sections(found())
    table = fit.blocks[0]
    assert isinstance(table, TableBlock)
    assert {row[0].text for row in table.rows} == {"2→3"}
    assert "output torque" in {row[1].text for row in table.rows}
    assert {cell.tone for row in table.rows for cell in row[2:]} == {Tone.GOOD}


def test_residuals_of_a_right_model_lie_in_the_band() -> None:
    block = build_likelihood_sections(found())[0].blocks[1]
    assert isinstance(block, FigureBlock)
    means = [np.asarray(trace.y) for trace in block.figure.data if trace.name == "mean"]
    assert len(means) == len(block.figure.panels)
    outside = np.mean(np.abs(np.concatenate(means)) > 1.96)
    assert outside < 0.08


def test_every_sensor_stands_over_the_columns() -> None:
    block = build_likelihood_sections(found())[1].blocks[0]
    assert isinstance(block, FigureBlock)
    gain, offset, age = block.figure.data
    assert {"T_e", "T_o", "n_in", "P B3"} <= set(gain.x)
    assert len(gain.x) == len(offset.x) == len(age.x)
    row = list(gain.y).index("η [%]")
    assert gain.text[row][list(gain.x).index("T_e")] == "−1.0"
    assert gain.text[row][list(gain.x).index("T_o")] == "+1.0"


def test_the_page_holds_them() -> None:
    page = render_report(found(), log())
    assert 'id="fit"' in page
    assert 'id="sensors"' in page


def test_the_fit_counts_its_residual_tests() -> None:
    fit = found().evidence.likelihood
    assert fit is not None
    assert count_consistent_residuals(fit) == (4 * 4, 4 * 4)
    assert "16 of 16 residual tests passed" in build_likelihood_sections(found())[0].intro
