# SPDX-License-Identifier: MIT
"""Verdict on a model in words: every status has a reason and a next action."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.files.result_file import ResultFile
from drivetwin.findings import Code, Finding, explain, report
from drivetwin.report.model_verdict import ModelVerdict, explain_identification, explain_result
from drivetwin.validation.simulate_log import attach_fit
from tests.report.sample import identification, validation

MISSES = report(Code.SIMULATION_MISSES, channel="output torque", fit=-235.0)


def explain_with(status: ModelStatus, *findings: Finding) -> ModelVerdict:
    return explain_identification(replace(identification(), status=status, findings=findings))


def simulated(status: ModelStatus) -> Identification:
    return replace(attach_fit(identification(), [validation()]), status=status)


@pytest.mark.parametrize("status", ModelStatus)
def test_each_status_has_reason_and_action(status: ModelStatus) -> None:
    verdict = explain_with(status)
    assert verdict.status is status
    for text in (verdict.reason, verdict.action):
        assert text.endswith(".")
        assert text[0].isupper()
        assert ".." not in text


@pytest.mark.parametrize("status", ModelStatus)
def test_a_result_file_has_the_verdict_of_its_identification(status: ModelStatus) -> None:
    found = simulated(status)
    assert explain_result(ResultFile.from_result(found)) == explain_identification(found)


def test_a_valid_model_names_the_fit() -> None:
    verdict = explain_identification(simulated(ModelStatus.VALID))
    fit = simulated(ModelStatus.VALID).fit["output_torque"]["all"].fit_percent
    assert f"(output torque: fit {fit:.1f} %)" in verdict.reason


def test_limits_name_open_and_weak_parameters_and_the_recording_that_helps() -> None:
    verdict = explain_identification(replace(simulated(ModelStatus.LIMITED), findings=()))
    assert "engine torque delay τ_e is not identifiable" in verdict.reason
    assert "shaft damping c_o is weak" in verdict.reason
    assert "step the pedal in gear" in verdict.action


def test_many_open_parameters_are_counted_not_listed() -> None:
    found = replace(simulated(ModelStatus.LIMITED), findings=())
    missing = {
        name: replace(one, value=None, verdict=Verdict.NOT_IDENTIFIABLE)
        for name, one in found.estimates.items()
    }
    verdict = explain_identification(replace(found, estimates=missing))
    assert f"and {len(missing) - 3} others are not identifiable" in verdict.reason
    assert len(verdict.text) < 500


def test_an_effect_comes_before_open_parameters() -> None:
    effect = report(
        Code.EFFECT_FOUND, effect="tyre slip", size="0.01", evidence=30.0, changes="η by 2 %",
        advice="Add the tyre to the model",
    )  # fmt: skip
    verdict = explain_with(ModelStatus.LIMITED, effect)
    assert "tyre slip (0.01)" in verdict.reason
    assert verdict.action == "Add the tyre to the model."


def test_without_torque_scale_the_sensor_is_asked_for() -> None:
    found = replace(simulated(ModelStatus.LIMITED), findings=())
    reason = explain(Code.NO_TORQUE_SCALE)
    open_ids = {**found.estimates, "eta": replace(found.estimates["eta"], reason=reason)}
    verdict = explain_identification(replace(found, estimates=open_ids))
    assert "divided by η" in verdict.reason
    assert verdict.action.startswith("Add an output-shaft torque sensor, or enter J_vehicle_kgm2")


def test_a_model_that_is_not_valid_names_error_and_suspect() -> None:
    suspect = report(Code.CARD_SUSPECT, entry="gain of B3", size=9.0)
    verdict = explain_with(ModelStatus.NOT_VALID, MISSES, suspect)
    assert verdict.reason.startswith(
        "Simulated output torque does not match the measurement (fit -235"
    )
    assert "No value counts as identified" in verdict.reason
    assert "gain of B3" in verdict.action


def test_without_a_suspect_the_remedy_of_the_error_is_the_action() -> None:
    verdict = explain_with(ModelStatus.NOT_VALID, report(Code.EFFICIENCY_IMPLAUSIBLE, value=0.6))
    assert verdict.action == "Check scale, unit and sign of both torque signals."
    assert "following findings" not in explain_with(ModelStatus.NOT_VALID, MISSES).action


def test_a_model_that_was_not_simulated_names_what_it_lacks() -> None:
    lacks = report(Code.NOT_VALIDATED, why="the twin cannot be simulated without te_delay (long)")
    verdict = explain_with(ModelStatus.NOT_VALIDATED, lacks)
    assert "engine torque delay τ_e is not identifiable" in verdict.reason
    gap = report(Code.NOT_VALIDATED, why="'TrqOut' was recorded from 1 s to 2 s only")
    assert "'TrqOut' was recorded" in explain_with(ModelStatus.NOT_VALIDATED, gap).reason
