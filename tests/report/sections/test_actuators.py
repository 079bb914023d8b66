# SPDX-License-Identifier: MIT
"""Section on actuators: values with intervals, and what is assumed."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.report.blocks import TableBlock
from drivetwin.report.sections.actuators import build_actuator_section
from tests.files.test_twin_file import ACTUATOR
from tests.report.sample import identification


def test_values_have_intervals_and_assumed_ones_are_named() -> None:
    section = build_actuator_section(replace(identification(), actuators={"B3": ACTUATOR}))
    (table,) = section.blocks
    assert isinstance(table, TableBlock)
    assert "B3: 1200 samples" in table.caption
    cells = {label.text: value for label, value in table.rows}
    assert cells["dead time T_d"].text == "20.0 ± 2.0 ms"
    assert cells["kiss pressure P_k"].note == "assumed, not determined"
    assert cells["hysteresis H"].note == ""


def test_without_commands_there_is_no_section() -> None:
    assert not build_actuator_section(identification()).blocks
