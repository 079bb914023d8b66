# SPDX-License-Identifier: MIT
"""The sections that show what was measured: what they say fits what the log has."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.report.blocks import FigureBlock
from drivetwin.report.sections.summary import build_friction_section, describe_phases
from drivetwin.vehicle.shift_kind import ShiftKind
from tests.report.sample import identification


def test_friction_without_an_output_torque_is_told_as_what_it_is() -> None:
    found = identification()
    curve = found.friction["B3"]
    ratio = replace(found, friction={"B3": replace(curve, over_eta=True)})
    with_torque, without = build_friction_section(found), build_friction_section(ratio)
    assert "follows from the output torque" in with_torque.intro
    assert "no output torque" in without.intro
    assert "output torque (eq. 16" not in without.intro
    for section, law in ((with_torque, "Stribeck law μ = "), (without, "Stribeck law μ/η = ")):
        block, _ = section.blocks
        assert isinstance(block, FigureBlock)
        assert law in block.caption


@pytest.mark.parametrize("kind", ShiftKind)
def test_the_key_of_the_phases_is_that_of_the_kind_of_shift(kind: ShiftKind) -> None:
    text = describe_phases(kind)
    assert ("the input speed falls" in text) == ("upshift" in kind.value)
    assert ("the input speed rises" in text) == ("downshift" in kind.value)
    assert ("output torque dips" in text) == (kind is ShiftKind.POWER_ON_UP)
    late = kind in (ShiftKind.POWER_OFF_UP, ShiftKind.POWER_ON_DOWN)
    assert ("takes hold only later" in text) == late
