# SPDX-License-Identifier: MIT
"""Findings and their catalogue: one entry for each code, texts from the numbers."""

from __future__ import annotations

import re
from pathlib import Path
from string import Formatter

import pytest

from drivetwin import findings
from drivetwin.errors import Where
from drivetwin.files.records import FindingRecord
from drivetwin.findings import (
    Code,
    Number,
    Severity,
    list_fields,
    load_catalogue,
    report,
    select_warnings,
    sort_by_severity,
)


def test_every_code_has_an_entry_and_each_entry_a_code() -> None:
    assert sorted(load_catalogue()) == sorted(Code)


def test_every_code_is_reported_somewhere() -> None:
    package = Path(findings.__file__).parent
    sources = "".join(path.read_text(encoding="utf-8") for path in package.rglob("*.py"))
    sources += "".join(path.read_text(encoding="utf-8") for path in package.rglob("card_*.toml"))
    names = [(code.name, rf"Code\.{code.name}\b|finding = \"{code.value}\"") for code in Code]
    assert [name for name, pattern in names if not re.search(pattern, sources)] == []


@pytest.mark.parametrize("code", Code)
def test_a_filled_text_has_no_double_stop(code: Code) -> None:
    """Names that end in a period, such as the advice on an effect."""
    names = {name: "a name." for name, spec in list_fields(code).items() if not spec}
    numbers = {name: 1.0 for name, spec in list_fields(code).items() if spec}
    text = report(code, "x", **names, **numbers).text
    assert not re.search(r"\.[.;,)]|  |[a-z][.?!][A-Z]", text)


@pytest.mark.parametrize("code", Code)
def test_texts_are_sentences(code: Code) -> None:
    entry = load_catalogue()[code]
    for text in (entry.text, entry.remedy):
        assert not text.endswith((".", " "))
        assert text[:1] == text[:1].upper()
    fields = [name for _, name, _, _ in Formatter().parse(entry.text + entry.remedy) if name]
    assert all(name.isidentifier() for name in fields)


def test_a_finding_shows_place_subject_numbers_and_remedy() -> None:
    place = Where(file="a.csv")
    limit = Number(2e5, "Pa")
    one = report(Code.AT_BOUND, "P0.B3", place, limit=limit, side="larger")
    assert one.text == (
        "a.csv: P0.B3: 2.000 bar is the bound of the search; the log indicates a larger value."
    )
    assert one.severity is Severity.ERROR
    assert one.names == {"side": "larger"}
    assert one.numbers == {"limit": limit}
    assert one.set_subject("other") == one
    assert report(Code.LOCKUP_UNKNOWN, channel="x").text.endswith("'lockup_engaged'.")


def test_the_subject_is_not_repeated() -> None:
    values = {"card": Number(1.0, "kg*m^2", 0.1), "log": Number(2.0, "kg*m^2", 0.1)}
    text = report(Code.CARD_CONTRADICTED, "J_out", **values, apart=7.1).text
    assert text.startswith("J_out: the vehicle card has 1.00 ± 0.10 kg·m², the log gives 2.00 ±")


def test_information_is_no_warning() -> None:
    told = report(Code.MEAN_SAMPLES, channels="engine speed")
    assert select_warnings([told]) == ()


def test_a_record_holds_all_of_a_finding() -> None:
    one = report(Code.LOADS_DIFFER, "", Where(channel="x", time=1.5), low=1.0, high=2.5)
    record = FindingRecord.model_validate_json(FindingRecord.from_result(one).model_dump_json())
    assert (record.code, record.severity) == (Code.LOADS_DIFFER, Severity.INFO)
    assert record.text == one.text
    assert record.to_finding() == one


def test_sorted_by_severity_errors_come_first_and_equals_keep_their_order() -> None:
    error, first, second, info = (
        report(Code.LIKELIHOOD_FAILED, why="x"),
        report(Code.STUCK, "a", places="1 s"),
        report(Code.STUCK, "b", places="1 s"),
        report(Code.NO_SENSOR_TOLERANCES),
    )
    assert sort_by_severity([info, first, second, error]) == [error, first, second, info]
