# SPDX-License-Identifier: MIT
"""Evidence of both methods, drawn from a given log."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.identification import Identification, StageResults
from drivetwin.estimation.result.method import Method
from drivetwin.logs.read import read_log
from drivetwin.pipeline import identify
from drivetwin.report.blocks import FigureBlock, NotesBlock, Section, TableBlock, Tone
from drivetwin.report.html import render_report
from drivetwin.report.sections.stage_results import build_stage_sections
from drivetwin.shifts.detect import detect_shifts
from drivetwin.twin.build import build_twin
from drivetwin.validation.simulate_log import attach_validation
from drivetwin.vehicle.card import load_card
from tests.report.sample import identification

ROOT = Path(__file__).parents[3]
LOG = ROOT.parent / "shared" / "logs" / "paper_like.csv"


@pytest.fixture(scope="module")
def given() -> tuple[Identification, ShiftLog]:
    if not LOG.exists():
        pytest.skip("the given logs are not beside the repository")
    card = load_card(ROOT / "examples" / "vehicles" / "paper_like.toml")
    log = read_log(LOG, card)
    found = identify(log, card, detect_shifts(log, card))
    return attach_validation(found, build_twin(found, card), log), log


def build_appendix(found: Identification) -> list[Section]:
    return [section for section in build_stage_sections(found) if section.collapsed]


def test_each_question_shows_both_methods(given: tuple[Identification, ShiftLog]) -> None:
    sections = {section.anchor: section.blocks for section in build_appendix(given[0])}
    figures = {
        anchor: sum(isinstance(block, FigureBlock) for block in blocks)
        for anchor, blocks in sections.items()
    }
    assert figures == {"appendix-inertia": 2, "appendix-load": 2, "appendix-shaft": 2}


@pytest.mark.parametrize("method", [Method.INTEGRAL, Method.PAPER])
def test_only_the_evidence_of_other_methods_is_collapsed(
    given: tuple[Identification, ShiftLog], method: Method
) -> None:
    evidence = replace(given[0].evidence, likelihood=None)
    found = replace(given[0], method=method, evidence=evidence)
    open_, closed = (
        [section for section in build_stage_sections(found) if section.collapsed is collapsed]
        for collapsed in (False, True)
    )
    for sections, is_paper in (
        (open_, method is Method.PAPER),
        (closed, method is Method.INTEGRAL),
    ):
        captions = [b.caption for one in sections for b in one.blocks if isinstance(b, FigureBlock)]
        assert captions
        assert all(text.startswith("The paper's") is is_paper for text in captions)


def test_tables_are_those_of_the_paper(given: tuple[Identification, ShiftLog]) -> None:
    inertia, load, _ = build_appendix(given[0])
    tables = [block for block in (*inertia.blocks, *load.blocks) if isinstance(block, TableBlock)]
    assert [row[0].text for row in tables[0].rows][::3] == ["1", "0.85", "0.7"]
    assert {"0", "500", "4000"} <= {row[0].text for row in tables[1].rows}
    assert all(sum(bool(row[3].text) for row in table.rows) == 1 for table in tables)


def test_a_doubtful_grid_is_not_marked_as_good(given: tuple[Identification, ShiftLog]) -> None:
    load = build_appendix(given[0])[1]
    (table,) = (block for block in load.blocks if isinstance(block, TableBlock))
    (doubt,) = (block for block in load.blocks if isinstance(block, NotesBlock))
    marks = [row[3] for row in table.rows if row[3].text]
    assert [mark.tone for mark in marks] == [Tone.DOUBTFUL]
    assert "outside its design range" in doubt.items[0]


def test_a_refused_stage_says_why(given: tuple[Identification, ShiftLog]) -> None:
    found = given[0]
    (one,) = found.evidence.integral
    refused = replace(one, ring=None, refusals={"shaft": "no oscillation"})
    shaft = build_stage_sections(replace(found, evidence=StageResults(integral=(refused,))))[2]
    assert [block.items for block in shaft.blocks if isinstance(block, NotesBlock)] == [
        ["Integral method: no oscillation"]
    ]


def test_report_of_a_whole_log_stays_small(given: tuple[Identification, ShiftLog]) -> None:
    assert len(render_report(*given).encode()) < 3_000_000


def test_without_evidence_nothing_is_drawn() -> None:
    assert not any(section.blocks for section in build_stage_sections(identification()))
