# SPDX-License-Identifier: MIT
"""Evidence of the paper's method, drawn from a given log."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.identification import Identification, StageResults
from drivetwin.estimation.result.method import Method
from drivetwin.logs.read import read_log
from drivetwin.pipeline import identify
from drivetwin.report.blocks import FigureBlock, NotesBlock, TableBlock, Tone
from drivetwin.report.html import build_report_page, render_page
from drivetwin.report.stage_results import build_stage_sections
from drivetwin.shifts.detect import detect_shifts
from drivetwin.twin.build import build_twin
from drivetwin.validation.simulate_log import attach_validation
from drivetwin.vehicle.card import load_card
from tests.report.sample import identification

ROOT = Path(__file__).parents[2]
LOG = ROOT.parent / "shared" / "logs" / "paper_like.csv"


@pytest.fixture(scope="module")
def given() -> tuple[Identification, ShiftLog]:
    if not LOG.exists():
        pytest.skip("the given logs are not beside the repository")
    card = load_card(ROOT / "examples" / "vehicles" / "paper_like.toml")
    log = read_log(LOG, card)
    found = identify(log, card, detect_shifts(log, card), Method.PAPER)
    return attach_validation(found, build_twin(found, card), log), log


def test_each_question_has_a_picture(given: tuple[Identification, ShiftLog]) -> None:
    sections = {section.anchor: section.blocks for section in build_stage_sections(given[0])}
    figures = {
        anchor: sum(isinstance(block, FigureBlock) for block in blocks)
        for anchor, blocks in sections.items()
    }
    assert figures == {"inertia": 1, "load": 1, "shaft": 1}


def test_tables_are_those_of_the_paper(given: tuple[Identification, ShiftLog]) -> None:
    inertia, load, _ = build_stage_sections(given[0])
    tables = [block for block in (*inertia.blocks, *load.blocks) if isinstance(block, TableBlock)]
    assert [row[0].text for row in tables[0].rows][::3] == ["1", "0.85", "0.7"]
    assert {"0", "500", "4000"} <= {row[0].text for row in tables[1].rows}
    assert all(sum(bool(row[3].text) for row in table.rows) == 1 for table in tables)


def test_a_doubtful_grid_is_not_marked_as_good(given: tuple[Identification, ShiftLog]) -> None:
    load = build_stage_sections(given[0])[1]
    (table,) = (block for block in load.blocks if isinstance(block, TableBlock))
    (doubt,) = (block for block in load.blocks if isinstance(block, NotesBlock))
    marks = [row[3] for row in table.rows if row[3].text]
    assert [mark.tone for mark in marks] == [Tone.DOUBTFUL]
    assert "outside its design range" in doubt.items[0]


def test_a_refused_stage_says_why(given: tuple[Identification, ShiftLog]) -> None:
    found = given[0]
    (one,) = found.evidence.paper
    refused = replace(one, ring=None, refusals={"shaft": "no oscillation"})
    shaft = build_stage_sections(replace(found, evidence=StageResults(paper=(refused,))))[2]
    assert [block.items for block in shaft.blocks if isinstance(block, NotesBlock)] == [
        ["The paper's method: no oscillation"]
    ]


def test_report_of_a_whole_log_stays_small(given: tuple[Identification, ShiftLog]) -> None:
    assert len(render_page(build_report_page(given[0], [given[1]])).encode()) < 3_000_000


def test_without_evidence_nothing_is_drawn() -> None:
    assert not any(section.blocks for section in build_stage_sections(identification()))
