# SPDX-License-Identifier: MIT
"""What of a twin goes into its parameter files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.drive import load_powertrain
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.export.parameters.content import Curve, Scalar
from drivetwin.export.parameters.of_twin import collect_parameters
from drivetwin.simulation.dual_clutch import Stribeck
from tests.export.parameters.sample import twin


def test_a_value_of_the_card_states_no_interval() -> None:
    """Its deviation is zero, and an interval without width would tell it as known exactly."""
    known = Estimate("P0.B3", 8e4, 0.0, Verdict.DESIGN, "card")
    given = twin()
    reported = collect_parameters(replace(given, parameters={**given.parameters, "P0.B3": known}))[
        "P0.B3"
    ]
    assert reported.text == "pressure at which the clutch fill ends; design value"


def test_an_identified_value_goes_before_the_design_value() -> None:
    content = collect_parameters(twin())
    assert [one.value for one in content.scalars if one.name == "P0.B3"] == [8.2e4]
    design = content["P0.B2"]
    assert isinstance(design, Scalar)
    assert (design.value, design.unit) == (8e4, "Pa")
    assert "design value" in design.text


@pytest.mark.parametrize(("ending", "value"), [("", 0.07), ("_over_eta", 0.08)])
def test_an_identified_drum_stands_once(ending: str, value: float) -> None:
    name, given = f"drum.B3{ending}", twin()
    assert [one.value for one in collect_parameters(given).scalars if "drum" in one.name] == [
        0.0,
        0.05,
    ]
    reported = Estimate(name, value, 0.01, Verdict.IDENTIFIED, "likelihood")
    content = collect_parameters(replace(given, parameters={**given.parameters, name: reported}))
    drums = {one.name: one for one in content.scalars if "drum" in one.name}
    assert set(drums) == {"drum.B2", name}
    assert drums[name].value == value
    assert "identified" in drums[name].text
    assert "design value" in drums["drum.B2"].text


@pytest.mark.parametrize("v_s", [1.0, 5.0, 15.0, 60.0])
@pytest.mark.parametrize("mu_s", [0.08, 0.20])
def test_the_curve_keeps_to_a_law_that_bends_near_zero_slip(v_s: float, mu_s: float) -> None:
    given, law = twin(), Stribeck(0.11, mu_s, v_s, 1e-4)
    seen = replace(given.friction["B3"], slip=np.linspace(0.0, 300.0, 60), stribeck=law)
    curve = collect_parameters(replace(given, friction={**given.friction, "B3": seen}))["mu.B3"]
    assert isinstance(curve, Curve)
    assert (curve.axis.points[-1], len(curve.axis.points)) == (300.0, 33)
    slip = np.linspace(0.0, 300.0, 20001)
    reported = np.interp(slip, curve.axis.points, curve.values)
    assert reported == pytest.approx(law.evaluate(slip), rel=1e-3)


def test_a_converter_brings_two_curves_over_the_speed_ratio() -> None:
    converter = load_powertrain("truck-324kw").converter
    content = collect_parameters(replace(twin(), converter=converter))
    ratio, capacity = (
        one
        for one in content.curves
        if one.name in ("converter.torque_ratio", "converter.capacity")
    )
    assert ratio.axis.points == capacity.axis.points == converter.speed_ratio
    assert (ratio.values, capacity.values) == (converter.torque_ratio, converter.capacity)
