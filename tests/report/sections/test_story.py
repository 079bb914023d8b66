# SPDX-License-Identifier: MIT
"""The sections that show what was measured: what they say fits what the log has."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.report.sections.blocks import FigureBlock
from drivetwin.report.sections.story import friction_section
from tests.report.sample import identification


def test_friction_without_an_output_torque_is_told_as_what_it_is() -> None:
    found = identification()
    curve = found.friction["B3"]
    ratio = replace(found, friction={"B3": replace(curve, over_eta=True)})
    with_torque, without = friction_section(found), friction_section(ratio)
    assert "follows from the output torque" in with_torque.intro
    assert "no output torque" in without.intro
    assert "output torque (eq. 16" not in without.intro
    for section, law in ((with_torque, "Stribeck law μ = "), (without, "Stribeck law μ/η = ")):
        (block,) = section.blocks
        assert isinstance(block, FigureBlock)
        assert law in block.caption
