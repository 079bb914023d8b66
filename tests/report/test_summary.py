# SPDX-License-Identifier: MIT
"""Sections of the page of an identification: cells and notes that follow from its values."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.findings import Code, Finding, explain, report
from drivetwin.likelihood.output import SignalFit
from drivetwin.report.summary import build_fit_table
from tests.files.test_twin_file import ACTUATOR
from tests.report.sample import build_section, identification, list_blocks, simulated, validation

MISSES = report(Code.SIMULATION_MISSES, channel="output torque", fit=-235.0)


def change_estimates(found: Identification, **changes: Any) -> Identification:
    """Change attributes of all estimates."""
    estimates = {name: replace(one, **changes) for name, one in found.estimates.items()}
    return replace(found, estimates=estimates)


def get_rows(found: Identification) -> dict[str, list[Any]]:
    """Return the rows of the table of parameters by id."""
    (table,) = list_blocks(found, "result", "table")
    return dict(zip(found.estimates, map(list, table.rows), strict=True))


def test_rows_carry_name_value_interval_unit_and_verdict() -> None:
    rows = get_rows(identification())
    texts = [cell.text for cell in rows["J_prime_2"]]
    assert texts[0] == "Inertia at engine J′ (2)"
    assert texts[1:] == ["17.50", "0.42", "0.16", "kg·m²", "identified", "likelihood"]
    assert rows["J_prime_2"][0].note == "J_prime_2"
    assert [rows["P0.B3"][k].text for k in (1, 4)] == ["0.820", "bar"]
    assert [rows["k_o"][k].text for k in (1, 4)] == ["176.0", "kNm/rad"]
    assert [rows["Tv_over_if"][k].text for k in (1, 4)] == ["2\u202f300", "Nm"]
    assert rows["c_o"][5].tone.value == "doubtful"
    assert [cell.text for cell in rows["te_delay"][1:4]] == ["–", "–", "–"]


def test_captions_count_identified_values_and_name_missing_tolerances() -> None:
    found = identification()
    bare = change_estimates(found, std_systematic=None)
    captions = [list_blocks(one, "result", "table")[0].caption for one in (found, bare)]
    assert ["no sensor tolerance" in one for one in captions] == [False, True]
    (table, *_) = list_blocks(bare, "limits", "table")
    assert {row[2].text for row in table.rows} == {"not stated"}
    design = replace(found.estimates["J_out"], verdict=Verdict.DESIGN)
    of_card = replace(found, estimates={**found.estimates, "J_out": design})
    (table,) = list_blocks(of_card, "result", "table")
    assert "9 of 12 parameters are identified" in table.caption
    assert "1 taken from the vehicle card" in table.caption
    total, noise = of_card.plot().data
    assert "J′ (2)" in total.y
    assert not {"τ_e", "Jo′"} & set(total.y)
    assert all(n <= t for n, t in zip(noise.x, total.x, strict=True))


def test_a_shared_remark_stands_once_with_its_parameters() -> None:
    found = identification()
    estimates = {
        name: replace(one, reason="poorly excited") if name in ("eta", "k_o") else one
        for name, one in found.estimates.items()
    }
    shared = replace(found, estimates=estimates)
    notes = list_blocks(shared, "result", "notes")[-1]
    assert notes.items[0] == "(1) η, k_o: poorly excited"
    marks = {name: row[5].text for name, row in get_rows(shared).items()}
    assert [marks[name] for name in ("eta", "k_o", "J_vehicle")] == [
        "identified (1)", "identified (1)", "identified",
    ]  # fmt: skip


def test_the_page_opens_with_verdict_and_the_shift_of_the_lowest_fit() -> None:
    good = validation()
    shift = replace(good.shift, start_gear="4", end_gear="5")
    fit = {"output_torque": {"all": SignalFit(1.0, 12.0)}}
    found = simulated(good, replace(good, shift=shift, fit=fit))
    blocks = build_section(found, "result").blocks
    assert [block.kind for block in blocks] == ["verdict", "figure", "table", "notes"]
    (figure,) = list_blocks(found, "result", "figure")
    assert figure.caption.startswith("Shift 4→5")


def test_fits_are_told_in_display_units_and_a_missed_phase_is_marked() -> None:
    found = simulated()
    whole = SignalFit(rmse=1.0, fit_percent=92.7)
    tables = list_blocks(found, "validation", "table")
    speed = next(row for one in tables for row in one.rows if row[0].text == "input speed")
    rmse = found.fit["input_speed"]["all"].rmse * 30.0 / np.pi
    number, unit = speed[1].note.split()
    assert float(number) == pytest.approx(rmse, rel=0.01, abs=1e-6)
    assert unit == "rpm"
    for phases, marked in (
        ({"all": whole, "before": whole, "inertia": SignalFit(3.7, 60.1)}, ["60.1 %"]),
        ({"all": whole, "before": SignalFit(1.1, 55.0), "inertia": whole}, []),
    ):
        cells = [cell for row in build_fit_table({"input_speed": phases}).rows for cell in row]
        assert [cell.text for cell in cells if cell.tone.value == "doubtful"] == marked


def test_limits_name_the_least_known_first_with_an_experiment() -> None:
    (table, *_) = list_blocks(identification(), "limits", "table")
    rows = table.rows
    assert [row[0].text for row in rows[:2]] == ["c_o", "Jo′"]
    assert (rows[0][1].text, rows[0][2].text) == ("± 32 %", "1 %")
    advice = {row[0].text: row[3].text for row in rows}
    assert "pedal" in advice["c_o"]
    assert "Calibrate" in advice["J′ (3)"]
    assert "another torque" in advice["Jo′"]
    close = replace(
        identification(),
        correlation_ids=("eta", "J_prime_2", "c_o"),
        correlation=np.array([[1.0, -0.95, 0.1], [-0.95, 1.0, 0.2], [0.1, 0.2, 1.0]]),
    )
    assert list_blocks(close, "limits", "notes")[-1].items == ["η and J′ (2): r = −0.95."]


def test_actuators_friction_and_origin() -> None:
    found = replace(identification(), actuators={"B3": ACTUATOR})
    (table,) = list_blocks(found, "actuators", "table")
    cells = {label.text: value for label, value in table.rows}
    assert cells["dead time T_d"].text == "20.0 ± 2.0 ms"
    (assumed,) = list_blocks(found, "provenance", "notes")
    borrowed = "friction of B2 is taken to be that of B3, ± 7 % beside the errors of both gains"
    assert borrowed in assumed.items
    rows = [row for one in list_blocks(found, "provenance", "table") for row in one.rows]
    last = {row[0].text: row[-1].text for row in rows}
    assert last["sample <1>.csv"] == "ab" * 32
    assert last["pressure"] == "bar"
    ratio = replace(found.friction["B3"], over_eta=True)
    for one, law, said in (
        (found, "Stribeck law μ = ", "follows from the output torque"),
        (replace(found, friction={"B3": ratio}), "Stribeck law μ/η = ", "no output torque"),
    ):
        assert said in build_section(one, "friction").intro
        (figure, *_) = list_blocks(one, "friction", "figure")
        assert law in figure.caption
        axis = "μ/η [–]" if "η" in law else "μ [–]"
        assert figure.figure.layout.yaxis.title.text == f"friction coefficient {axis}"


def test_findings_are_listed_by_severity() -> None:
    findings = (
        report(Code.NO_SENSOR_TOLERANCES, gains="output torque 0.5 %"),
        report(Code.GEAR_POORLY_EXCITED, variation=1.0, gear="2"),
        report(Code.LIKELIHOOD_FAILED, why="no minimum"),
    )
    blocks = list_blocks(replace(identification(), findings=findings), "findings", "notes")
    assert [(one.heading, one.tone.value) for one in blocks] == [
        ("Errors", "bad"), ("Warnings", "doubtful"), ("Information", "plain"),
    ]  # fmt: skip


def explain_with(found: Identification, status: ModelStatus, *findings: Finding) -> Any:
    """Return the verdict of the page."""
    (first, *_) = list_blocks(replace(found, status=status, findings=findings), "result", "verdict")
    return first


@pytest.mark.parametrize("status", ModelStatus)
def test_each_status_has_colour_reason_and_action(status: ModelStatus) -> None:
    verdict = explain_with(identification(), status)
    assert verdict.status == status.value
    tones = {ModelStatus.VALID: "good", ModelStatus.NOT_VALID: "bad"}
    assert verdict.tone.value == tones.get(status, verdict.tone.value)
    assert (verdict.tone.value == "good") == (status is ModelStatus.VALID)
    for text in (verdict.reason, verdict.action):
        assert text.endswith(".")
        assert text[0].isupper()
        assert ".." not in text


def test_reasons_of_the_verdict() -> None:
    fit = simulated().fit["output_torque"]["all"].fit_percent
    valid = explain_with(simulated(), ModelStatus.VALID)
    assert f"(output torque: fit {fit:.1f} %)" in valid.reason
    limited = explain_with(simulated(), ModelStatus.LIMITED)
    assert "engine torque delay τ_e is not identifiable" in limited.reason
    assert "shaft damping c_o is weak" in limited.reason
    assert "step the pedal in gear" in limited.action
    open_ = change_estimates(simulated(), value=None, verdict=Verdict.NOT_IDENTIFIABLE)
    many = explain_with(open_, ModelStatus.LIMITED)
    assert f"and {len(open_.estimates) - 3} others are not identifiable" in many.reason
    effect = report(
        Code.EFFECT_FOUND, effect="tyre slip", size="0.01", evidence=30.0, changes="η by 2 %",
        advice="Add the tyre to the model",
    )  # fmt: skip
    found = explain_with(identification(), ModelStatus.LIMITED, effect)
    assert "tyre slip (0.01)" in found.reason
    assert found.action == "Add the tyre to the model."
    scale = replace(simulated().estimates["eta"], reason=explain(Code.NO_TORQUE_SCALE))
    without = replace(simulated(), estimates={**simulated().estimates, "eta": scale})
    verdict = explain_with(without, ModelStatus.LIMITED)
    assert "divided by η" in verdict.reason
    assert verdict.action.startswith("Add an output-shaft torque sensor, or enter J_vehicle_kgm2")


def test_a_model_that_is_not_valid_or_not_simulated_names_error_and_suspect() -> None:
    found = identification()
    suspect = report(Code.CARD_SUSPECT, entry="gain of B3", size=9.0)
    verdict = explain_with(found, ModelStatus.NOT_VALID, MISSES, suspect)
    assert "does not match the measurement (fit -235" in verdict.reason
    assert "No value counts as identified" in verdict.reason
    assert "gain of B3" in verdict.action
    implausible = report(Code.EFFICIENCY_IMPLAUSIBLE, value=0.6)
    verdict = explain_with(found, ModelStatus.NOT_VALID, implausible)
    assert verdict.action == "Check scale, unit and sign of both torque signals."
    for why, said in (
        ("the twin cannot be simulated without te_delay (long)", "engine torque delay τ_e is not"),
        ("'TrqOut' was recorded from 1 s to 2 s only", "'TrqOut' was recorded"),
    ):
        lacks = report(Code.NOT_VALIDATED, why=why)
        assert said in explain_with(found, ModelStatus.NOT_VALIDATED, lacks).reason
