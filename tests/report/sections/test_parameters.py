# SPDX-License-Identifier: MIT
"""First sections: verdict, overview, parameters, findings by severity."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import SignalFit, Verdict
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.findings import Code, report
from drivetwin.report.blocks import Cell, FigureBlock, NotesBlock, Tone, VerdictBlock
from drivetwin.report.figures.parameters import plot_intervals
from drivetwin.report.sections.findings import build_findings_section
from drivetwin.report.sections.parameters import (
    build_parameter_table,
    build_result_section,
)
from drivetwin.validation.simulate_log import attach_fit
from tests.report.sample import identification, validation


def rows_by_id(found: Identification | None = None) -> dict[str, list[Cell]]:
    found = found or identification()
    rows = map(list, build_parameter_table(found.estimates).rows)
    return dict(zip(found.estimates, rows, strict=True))


def test_rows_carry_name_value_interval_unit_and_verdict() -> None:
    rows = rows_by_id()
    texts = [cell.text for cell in rows["J_prime_2"]]
    assert texts[0] == "Inertia at engine J′ (2)"
    assert texts[1:] == ["17.50", "0.42", "0.16", "kg·m²", "identified", "integral"]
    assert rows["J_prime_2"][0].note == "J_prime_2"
    assert (rows["J_vehicle"][0].text, rows["J_vehicle"][0].note) == (
        "Vehicle inertia J_vehicle", "",
    )  # fmt: skip
    assert rows["P0.B3"][1].text == "0.820"
    assert rows["P0.B3"][4].text == "bar"
    assert rows["c_o"][5].tone is Tone.DOUBTFUL


def test_large_torque_units_are_shown_in_kilo() -> None:
    rows = rows_by_id()
    assert [rows["k_o"][k].text for k in (1, 4)] == ["176.0", "kNm/rad"]
    assert [rows["Tv_over_if"][k].text for k in (1, 4)] == ["2\u202f300", "Nm"]


def test_parameter_that_cannot_be_told_shows_no_number() -> None:
    assert [cell.text for cell in rows_by_id()["te_delay"][1:4]] == ["–", "–", "–"]


def test_missing_sensor_tolerances_are_said() -> None:
    found = identification()
    plain = {key: replace(one, std_systematic=None) for key, one in found.estimates.items()}
    assert "no sensor tolerance" not in build_parameter_table(found.estimates).caption
    assert "no sensor tolerance" in build_parameter_table(plain).caption


def test_the_first_section_opens_with_verdict_plot_and_table() -> None:
    found = attach_fit(identification(), [validation()])
    blocks = build_result_section(found).blocks
    assert [block.kind for block in blocks] == ["verdict", "figure", "table", "notes"]


def test_the_colour_of_the_verdict_is_that_of_the_status() -> None:
    tones = {}
    for status in ModelStatus:
        first = build_result_section(replace(identification(), status=status)).blocks[0]
        assert isinstance(first, VerdictBlock)
        assert first.status == status.value
        tones[status] = first.tone
    assert tones[ModelStatus.VALID] is Tone.GOOD
    assert tones[ModelStatus.NOT_VALID] is Tone.BAD
    assert Tone.GOOD not in (tones[ModelStatus.LIMITED], tones[ModelStatus.NOT_VALIDATED])


def test_the_overview_is_of_the_shift_with_the_lowest_fit() -> None:
    good = validation()
    shift = replace(good.shift, start_gear="4", end_gear="5")
    fit = {"output_torque": {"all": SignalFit(1.0, 12.0)}}
    found = attach_fit(identification(), [good, replace(good, shift=shift, fit=fit)])
    figure = build_result_section(found).blocks[1]
    assert isinstance(figure, FigureBlock)
    assert figure.caption.startswith("Shift 4→5")


def test_a_shared_remark_stands_once_with_its_parameters() -> None:
    found = identification()
    shared = {
        name: replace(one, reason="poorly excited") if name in ("eta", "k_o") else one
        for name, one in found.estimates.items()
    }
    told = replace(found, estimates=shared)
    notes = build_result_section(told).blocks[-1]
    assert isinstance(notes, NotesBlock)
    assert notes.items[0] == "(1) η, k_o: poorly excited"
    marks = {name: row[5].text for name, row in rows_by_id(told).items()}
    assert (marks["eta"], marks["k_o"]) == ("identified (1)", "identified (1)")
    assert marks["J_vehicle"] == "identified"


def test_intervals_of_what_was_found_only() -> None:
    estimates = identification().estimates
    estimates["J_out"] = replace(estimates["J_out"], verdict=Verdict.DESIGN)
    total, noise = plot_intervals(estimates).data
    assert "J′ (2)" in total.y
    assert "τ_e" not in total.y
    assert "Jo′" not in total.y
    assert all(n <= t for n, t in zip(noise.x, total.x, strict=True))


def test_design_values_do_not_count_as_identified() -> None:
    found = identification()
    estimates = {
        **found.estimates,
        "J_out": replace(found.estimates["J_out"], verdict=Verdict.DESIGN),
    }
    caption = build_parameter_table(estimates).caption
    assert "9 of 12 parameters are identified" in caption
    assert "1 taken from the vehicle card" in caption


def test_findings_are_listed_by_severity() -> None:
    findings = (
        report(Code.NO_SENSOR_TOLERANCES),
        report(Code.GEAR_POORLY_EXCITED, variation=1.0, gear="2"),
        report(Code.LIKELIHOOD_FAILED, why="no minimum"),
    )
    blocks = build_findings_section(findings).blocks
    told = [(one.heading, one.tone) for one in blocks if isinstance(one, NotesBlock)]
    assert told == [
        ("Errors", Tone.BAD),
        ("Warnings", Tone.DOUBTFUL),
        ("Information", Tone.PLAIN),
    ]
