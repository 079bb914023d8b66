# SPDX-License-Identifier: MIT
"""Findings: one contract for every code of the catalogue, and remedies that fit the card."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import drivetwin
from drivetwin.cli import main
from drivetwin.errors import Where
from drivetwin.estimation.likelihood.uncertainty.torque_scale import OverEta, estimate_absolute
from drivetwin.files.records import FindingRecord
from drivetwin.findings import (
    Code,
    Finding,
    Number,
    list_fields,
    load_catalogue,
    render,
    report,
    select_warnings,
)
from tests.support.repeats import mark_repeats
from tools.findings_page import PAGE, ROOT, make_anchor, write_page

PACKAGE = Path(drivetwin.__file__).parent


@cache
def read_sources() -> str:
    """Text of all sources that can report a finding."""
    paths = [*PACKAGE.rglob("*.py"), *PACKAGE.rglob("card_*.toml")]
    return "".join(path.read_text(encoding="utf-8") for path in paths)


@cache
def read_rows() -> dict[str, str]:
    """Anchor of the question by code, as the page of findings links it."""
    rows = re.findall(r"^\| `(\w+)`.*questions\.md#([^)]+)\) \|$", write_page(), re.MULTILINE)
    return dict(rows)


def fill(code: Code) -> Finding:
    """A finding of the code; its names end in a period, as the advice on an effect does."""
    fields = list_fields(code).items()
    names = {name: "a name." for name, spec in fields if not spec}
    return report(
        code, "x", Where(time=1.5), **names, **{name: 1.0 for name, spec in fields if spec}
    )


@pytest.mark.parametrize("code", Code)
def test_a_code_keeps_the_contract_of_findings(code: Code) -> None:
    """Sentences in the catalogue, a reporter, an answer on the page, and a record of all of it."""
    entry = load_catalogue()[code]
    for text in (entry.text, entry.remedy):
        assert not text.endswith((".", " "))
        assert text[:1] == text[:1].upper()
        assert "`" not in text
    one = fill(code)
    assert not re.search(r"\.[.;,)]|  |[a-z][.?!][A-Z]| [,.;:]", one.text)
    assert one.text.endswith((".", "?", "!"))
    assert re.search(rf"Code\.{code.name}\b|finding = \"{code.value}\"", read_sources())
    questions = (ROOT / "docs" / "questions.md").read_text(encoding="utf-8")
    titles = re.findall(r"^## (.+)$", questions, re.MULTILINE)
    assert read_rows()[code.value] in {make_anchor(title) for title in titles}
    record = FindingRecord.model_validate_json(FindingRecord.from_result(one).model_dump_json())
    assert record.to_finding() == one
    assert (record.severity, record.text) == (entry.severity, one.text)


def test_catalogue_and_page_have_each_code_once() -> None:
    assert sorted(load_catalogue()) == sorted(Code)
    assert PAGE.read_text(encoding="utf-8") == write_page()


def test_a_finding_shows_place_subject_numbers_and_remedy() -> None:
    limit = Number(2e5, "Pa")
    one = report(Code.AT_BOUND, "P0.B3", Where(file="a.csv"), limit=limit, side="larger")
    assert one.text == (
        "a.csv: P0.B3: 2.000 bar is the bound of the search; the log indicates a larger value."
    )
    assert (one.names, one.numbers) == ({"side": "larger"}, {"limit": limit})
    assert one.set_subject("other") == one
    values = {"card": Number(1.0, "kg*m^2", 0.1), "log": Number(2.0, "kg*m^2", 0.1)}
    text = report(Code.CARD_CONTRADICTED, "J_out", **values, apart=7.1).text
    assert text.startswith("J_out: the vehicle card has 1.00 ± 0.10 kg·m², the log gives 2.00 ±")


def test_equal_findings_are_one_text_with_their_number_and_the_worst() -> None:
    """Of contradictions the least probable; of equal texts in several files the first."""
    shifts = [
        report(Code.BUS_SHIFTS_CONTRADICT, shift=f"shift {k}", quantity="f_d", p=10.0**-k)
        for k in (2, 4, 3, 2.5, 2.2)
    ]
    (text,) = render(shifts)
    assert text.startswith("Shift 4 contradicts" if text[0] == "S" else "shift 4 contradicts")
    assert text.endswith("(5 of this kind; also shift 2, shift 3, shift 2.5 and 1 more)")
    files = [
        report(Code.NO_SENSOR_TOLERANCES, gains="x").set_file(name) for name in ("a.csv", "b.csv")
    ]
    (text,) = render(files)
    assert text.startswith("a.csv: ")
    assert text.endswith("(2 of this kind; also b.csv)")
    different = [report(Code.STUCK, name, places=f"at {name}") for name in "ab"]
    assert render(different) == tuple(one.text for one in different)
    assert select_warnings([*files, *different]) == tuple(different)


STATED = """
[effects]
input_drag = 0.005
"""
"""Entry that a made card lacks; the rest of the card states everything else."""


def list_asked(remedy: str, card: str) -> set[str]:
    """List the entries of a card that a remedy asks to enter or to state."""
    asked = re.findall(r"\b(?:enter|state)\b[^.;]*", remedy, re.IGNORECASE)
    keys = re.findall(r"^\[*([\w.]+)[\]]*(?: =|$)", card, re.MULTILINE)
    known = {part for key in keys for part in key.split(".")} - {"name", "value", "std"}
    known |= {key.removesuffix("_kgm2") for key in known}
    return known & {word for text in asked for word in re.findall(r"\w+", text)}


def test_a_stated_scale_that_the_log_contradicts_is_not_asked_for() -> None:
    nothing = np.zeros((1, 1))
    over_eta = OverEta({"J_vehicle_over_eta": 1.0}, nothing, nothing, {})
    for known, code in (
        ({}, Code.NO_TORQUE_SCALE),
        ({"J_vehicle": 6e4}, Code.LOG_CONTRADICTS_CARD),
    ):
        driveline: Any = SimpleNamespace(known=known)
        one = estimate_absolute(["J_vehicle"], over_eta, None, driveline)["J_vehicle"]
        assert one.reason.startswith(report(code).reason)


def test_a_request_is_recognised() -> None:
    scale = report(Code.NO_TORQUE_SCALE).remedy
    assert list_asked(scale, "[inertia]\nJ_vehicle_kgm2 = 1.0") == {"J_vehicle_kgm2"}
    assert list_asked(scale, "[inertia]\nJ_out_kgm2 = 1.0") == set()


@pytest.mark.parametrize("is_quick", mark_repeats([True, False], [True]))
@pytest.mark.parametrize("scenario", mark_repeats(("paper_steps", "dual_clutch"), ("paper_steps",)))
def test_a_remedy_never_asks_for_what_is_stated(
    scenario: str, is_quick: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, log_path = tmp_path / "log.card.toml", tmp_path / "log.csv"
    assert main(["synth", "--scenario", scenario, "--seed", "1", "-o", str(log_path)]) == 0
    stated = "gain_tolerance = 0.01\noffset_tolerance_Nm = 5.0"
    text = path.read_text(encoding="utf-8").replace("gain_tolerance = 0.0", stated) + STATED
    assert text.count(stated) == 2
    path.write_text(text, encoding="utf-8")
    card = drivetwin.load_card(path)
    log = drivetwin.read_log(log_path, card)
    shifts = drivetwin.detect_shifts(log, card)
    with drivetwin.quick(is_quick):
        found = drivetwin.identify(log, card, shifts)
    reported = [one.remedy for one in found.findings]
    reported += [one.reason for one in found.estimates.values()]
    for command in (["inspect"], ["shifts"], ["card", "check"]):
        capsys.readouterr()
        end = (
            [str(path), str(log_path)]
            if command[0] == "card"
            else [str(log_path), "--vehicle", str(path)]
        )
        main([*command, *end])
        reported.append(" ".join(" ".join(capsys.readouterr()).split()))
    assert {one: asked for one in reported if (asked := list_asked(one, text))} == {}
