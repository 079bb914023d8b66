# SPDX-License-Identifier: MIT
"""What cannot be told, with the experiment that would tell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.estimation.identification import StageResults
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.estimation.result.suggestion import (
    CardNumber,
    CardNumberKind,
    ExpectedPrecision,
    Experiment,
    ExperimentRanking,
)
from drivetwin.report.blocks import NotesBlock, TableBlock
from drivetwin.report.sections.identifiability import build_limits_section
from tests.report.sample import identification


def tables() -> list[TableBlock]:
    blocks = build_limits_section(identification()).blocks
    return [block for block in blocks if isinstance(block, TableBlock)]


def test_the_least_known_come_first_with_an_experiment() -> None:
    rows = tables()[0].rows
    assert [row[0].text for row in rows[:2]] == ["c_o", "Jo′"]
    assert rows[0][1].text == "± 32 %"
    assert "pedal" in rows[0][3].text
    assert rows[0][2].text == "1 %"


def test_what_the_sensors_decide_is_not_said_to_be_narrowed_by_an_experiment() -> None:
    advice = {row[0].text: row[3].text for row in tables()[0].rows}
    assert "Calibrate" in advice["J′ (3)"]
    assert "another torque" in advice["Jo′"]


def test_sensors_without_a_tolerance_have_no_share() -> None:
    found = identification()
    bare = {name: replace(one, std_systematic=None) for name, one in found.estimates.items()}
    blocks = build_limits_section(replace(found, estimates=bare)).blocks
    table = next(block for block in blocks if isinstance(block, TableBlock))
    assert {row[2].text for row in table.rows} == {"not stated"}


def test_close_pairs_are_named() -> None:
    found = replace(
        identification(),
        correlation_ids=("eta", "J_prime_2", "c_o"),
        correlation=np.array([[1.0, -0.95, 0.1], [-0.95, 1.0, 0.2], [0.1, 0.2, 1.0]]),
    )
    notes = [block for block in build_limits_section(found).blocks if isinstance(block, NotesBlock)]
    assert notes[-1].items == ["η and J′ (2): r = −0.95."]


def test_simulated_experiments_take_the_place_of_the_general_advice() -> None:
    best = ExpectedPrecision(Experiment.THROTTLE_STEPS, 2, 0.25e-3, Verdict.IDENTIFIED)
    limit = "the gain of the torque sensor"
    number = CardNumber(CardNumberKind.PARAMETER, "P0.B3", share=0.5)
    told = (
        ExperimentRanking("te_delay", Verdict.NOT_IDENTIFIABLE, float("inf"), (best,)),
        ExperimentRanking("eta", Verdict.IDENTIFIED, 0.02, (), limit, number),
    )
    found = identification()
    found = replace(found, evidence=StageResults(suggestions=told))
    tables = [one for one in build_limits_section(found).blocks if isinstance(one, TableBlock)]
    rows = [[cell.text for cell in row] for row in tables[0].rows]
    assert rows == [
        [
            "τ_e",
            "not identifiable",
            "open",
            f"{Experiment.THROTTLE_STEPS}, 2 times",
            "± 0.25 ms",
            "–",
            "–",
        ],
        ["η", "identified", "± 0.020", "–", "–", "P0 (B3)", "± 0.010"],
    ]
    (notes,) = [
        one
        for one in build_limits_section(found).blocks
        if isinstance(one, NotesBlock) and one.heading == "Not narrowed by an experiment"
    ]
    assert notes.items == [f"η: {limit}"]
