# SPDX-License-Identifier: MIT
"""Entries of the card that explain a failed gate: the gain of an element that never slips."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.errors import Where
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.findings import Code, Finding, make_row
from drivetwin.report.model_verdict import explain_identification
from drivetwin.validation.gate import find_undetermined_gains
from tests.report.sample import identification


def test_the_gain_of_an_element_without_friction_of_its_own_is_named() -> None:
    found = identification()
    (shift,) = found.shifts
    name = f"{shift.start_gear}-{shift.end_gear}"
    row = make_row(channel="output torque", phase="torque", ratio=6.0, shift=name)
    missed = [Finding(Code.SIMULATION_OUTSIDE_SPREAD, "", Where(), row.numbers, row.names, (row,))]
    one_sided = replace(found, friction={shift.oncoming: next(iter(found.friction.values()))})
    (named,) = find_undetermined_gains(one_sided, missed)
    assert named.names == {"element": shift.offgoing, "other": shift.oncoming}
    assert find_undetermined_gains(one_sided, []) == []
    failed = replace(one_sided, status=ModelStatus.NOT_VALID, findings=(*missed, named))
    assert f"gain of {shift.offgoing}" in explain_identification(failed).action
