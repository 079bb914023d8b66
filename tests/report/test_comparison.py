# SPDX-License-Identifier: MIT
"""The page that compares several identifications, and logs simulated by each."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from drivetwin.estimation.result.estimate import Z95
from drivetwin.report.blocks import FigureBlock, TableBlock
from drivetwin.report.comparison import (
    build_agreement_section,
    build_trial_sections,
    render_comparison,
    simulate_trials,
)
from drivetwin.report.figures.comparison import plot_agreement, plot_trial
from drivetwin.report.find_reports import Candidate, Trial
from drivetwin.report.style import get_candidate_style
from drivetwin.twin.build import build_twin
from drivetwin.twin.twin import Twin
from tests.report.sample import SHIFT, card, friction, identification, log, validation
from tests.report.test_find_reports import candidate


@cache
def twins() -> dict[str, Twin]:
    good = build_twin(identification(), card())
    poor = replace(good, parameters={k: v for k, v in good.parameters.items() if k != "k_o"})
    return {"good": good, "poor": poor}


def candidates() -> list[Candidate]:
    first = replace(
        candidate("first <1>", eta=(0.90, 0.001), k_o=(1e5, 1e3)), friction={"B3": friction()}
    )
    return [first, candidate("second", eta=(0.92, 0.001), k_o=(1.01e5, 1e3))]


def test_what_differs_is_named_first() -> None:
    section = build_agreement_section(candidates())
    assert section.intro.startswith("1 of 2 common parameters agree")
    table = next(block for block in section.blocks if isinstance(block, TableBlock))
    assert [(row[0].text, row[-1].text) for row in table.rows] == [
        ("η", "differ"),
        ("k_o", "agree"),
    ]


def test_what_has_no_interval_is_named_beside_the_verdict() -> None:
    pair = [
        candidate("a", J_vehicle=(6059.7, 8.8), k_o=(1e5, None), eta=(0.9, 0.01)),
        candidate("b"),
    ]
    paper = candidate("paper", J_vehicle=(6295.0, None), k_o=(1e5, None))
    table = next(
        block
        for block in build_agreement_section([*pair, paper]).blocks
        if isinstance(block, TableBlock)
    )
    assert [(row[-1].text, row[-1].note) for row in table.rows] == [
        ("differ", "no interval: paper"),
        ("not judged", "no interval: a, paper"),
        ("", ""),
    ]


def test_narrow_and_wide_parameters_are_drawn_alike() -> None:
    section = build_agreement_section(candidates())
    block = next(block for block in section.blocks if isinstance(block, FigureBlock))
    first, second = block.figure.data
    assert np.allclose(first.error_x.array, Z95)
    assert np.allclose(np.asarray(second.x) - np.asarray(first.x), [20.0, 1.0])


def test_a_candidate_without_a_parameter_has_no_point() -> None:
    pair = [candidate("a", eta=(0.9, 0.01), k_o=(1e5, 1e3)), candidate("b", eta=(0.9, 0.01))]
    section = build_agreement_section([*pair, candidate("c", k_o=(1e5, 1e3))])
    block = next(block for block in section.blocks if isinstance(block, FigureBlock))
    assert [len(trace.x) for trace in block.figure.data] == [2, 1, 1]
    assert len(plot_agreement(["a"], []).data) == 1


def test_every_twin_simulates_or_says_why_not() -> None:
    (trial,) = simulate_trials(twins(), log(), [SHIFT], "sample.csv")
    assert trial.label == "sample.csv, 2→3 at 1.6 s"
    assert list(trial.runs) == ["good"]
    assert "k_o" in trial.refused["poor"]


def test_simulations_stand_over_one_measurement() -> None:
    trial = Trial("log", {"a": validation(), "b": validation()}, {})
    names = [trace.name for trace in plot_trial(trial, ["a", "b"]).data]
    assert names[:5] == ["measured", "a", "b", "a", "b"]
    matrix, shifts = build_trial_sections([candidate("a"), candidate("b")], [trial])
    block = matrix.blocks[0]
    assert isinstance(block, FigureBlock)
    fit = validation().fit["output_torque"]["all"].fit_percent
    assert block.figure.data[0].text[0][0] == f"{fit:.1f}"
    assert isinstance(shifts.blocks[1], TableBlock)


def test_many_candidates_are_told_apart() -> None:
    styles = [get_candidate_style(k) for k in range(24)]
    assert len({(one.colour, one.dash) for one in styles}) == 24


def test_the_page_is_complete_and_escaped() -> None:
    trials = simulate_trials({"first <1>": twins()["good"]}, log(), [SHIFT], "sample.csv")
    page = render_comparison(candidates(), trials)
    for anchor in ("agreement", "logs", "shifts", "friction"):
        assert f'id="{anchor}"' in page
    assert "first <1>" not in page
    alone = render_comparison(candidates()[:1], trials)
    assert 'id="agreement"' not in alone
