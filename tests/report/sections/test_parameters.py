# SPDX-License-Identifier: MIT
"""First page: verdicts, agreement, intervals."""

from __future__ import annotations

from dataclasses import replace

from drivetwin._util.display_units import RPM, format_significant
from drivetwin.estimation.result.estimate import SignalFit, Verdict
from drivetwin.report.figures.parameters import plot_intervals
from drivetwin.report.sections.blocks import TilesBlock, Tone
from drivetwin.report.sections.parameters import (
    build_fit_table,
    build_parameter_table,
    build_parameters_section,
)
from drivetwin.validation.simulate_log import attach_fit
from tests.report.sample import identification, validation


def test_rows_carry_value_interval_unit_and_verdict() -> None:
    rows = {
        row[0].note.split(" · ")[1]: row for row in build_parameter_table(identification()).rows
    }
    texts = [cell.text for cell in rows["J_prime_2"]]
    assert texts[0] == "J′ (2)"
    assert texts[1:] == ["17.50", "0.42", "0.16", "kg·m²", "identified", "integral"]
    assert rows["P0.B3"][1].text == "0.820"
    assert rows["P0.B3"][4].text == "bar"
    assert rows["c_o"][5].tone is Tone.DOUBTFUL


def test_parameter_that_cannot_be_told_shows_no_number() -> None:
    rows = {
        row[0].note.split(" · ")[1]: row for row in build_parameter_table(identification()).rows
    }
    assert [cell.text for cell in rows["te_delay"][1:4]] == ["–", "–", "–"]


def test_the_reason_of_a_verdict_stands_in_its_row() -> None:
    rows = {
        row[0].note.split(" · ")[1]: row for row in build_parameter_table(identification()).rows
    }
    assert rows["c_o"][0].remark == "the oscillation is short"
    assert rows["J_prime_2"][0].remark == ""


def test_missing_sensor_tolerances_are_said() -> None:
    found = identification()
    plain = {key: replace(one, std_systematic=None) for key, one in found.estimates.items()}
    assert "no sensor tolerance" not in build_parameter_table(found).caption
    assert "no sensor tolerance" in build_parameter_table(replace(found, estimates=plain)).caption


def test_fit_table_shows_percent_and_rmse_in_display_units() -> None:
    found = attach_fit(identification(), [validation()])
    speed = next(row for row in build_fit_table(found).rows if row[0].text == "input speed")
    rmse = found.fit["input_speed"]["all"].rmse
    assert speed[1].note == f"{format_significant(rmse * RPM.factor, 3)} rpm"


def test_warnings_stand_above_the_table() -> None:
    kinds = [block.kind for block in build_parameters_section(identification()).blocks]
    assert kinds == ["verdict", "tiles", "notes", "table", "figure"]


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
    intro = build_parameters_section(replace(found, estimates=estimates)).intro
    assert "9 of 12 parameters are identified" in intro
    assert "1 taken from the vehicle card" in intro


def test_a_shared_remark_stands_once() -> None:
    found = identification()
    shared = {
        name: replace(one, reason="poorly excited") if name in ("eta", "k_o") else one
        for name, one in found.estimates.items()
    }
    rows = build_parameter_table(replace(found, estimates=shared)).rows
    remarks = {row[0].text: row[0].remark for row in rows}
    assert (remarks["η"], remarks["k_o"], remarks["J_vehicle"]) == (
        "poorly excited",
        "as for η",
        "",
    )


def test_a_phase_that_the_simulation_misses_stands_against_a_good_fit_of_the_whole() -> None:
    found = attach_fit(identification(), [validation()])
    whole = SignalFit(rmse=1.0, fit_percent=92.7)
    missed = {"all": whole, "before": whole, "inertia": SignalFit(3.7, 60.1)}
    still = {"all": whole, "before": SignalFit(1.1, 55.0), "inertia": whole}
    told = replace(found, fit={"input_speed": missed, "output_speed": still}, findings=())
    section = build_parameters_section(told)
    second = section.blocks[1]
    assert isinstance(second, TilesBlock)
    tiles = {tile.label: tile for tile in second.tiles}
    assert tiles["fit of input speed"].tone is Tone.DOUBTFUL
    assert tiles["fit of input speed"].note.endswith("; 3 inertia phase: 60.1 %")
    assert tiles["fit of output speed"].tone is Tone.GOOD
