# SPDX-License-Identifier: MIT
"""SSV: valid against the schema of SSP 1.0; curves as indexed scalars, units as base units."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import fmpy
import pytest
from lxml import etree

from drivetwin.export.parameters.content import Axis, Curve, ParameterSet, Scalar
from drivetwin.export.parameters.files import ParameterFormat
from drivetwin.export.parameters.of_twin import collect_parameters
from drivetwin.export.targets import Names
from tests.export.parameters.sample import format_parameters, parse_parameters, twin

CURVE = Curve("mu.B3", Axis("slip", (0.0, 20.0), "rad/s"), (0.13, 0.12), text="friction")
NAMESPACES = {
    "ssv": "http://ssp-standard.org/SSP1/SystemStructureParameterValues",
    "ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
}


@pytest.mark.parametrize("names", Names)
def test_ssv_is_valid(names: Names) -> None:
    folder = Path(fmpy.__path__[0]) / "ssp" / "schema"
    schema = etree.XMLSchema(etree.parse(folder / "SystemStructureParameterValues.xsd"))
    document = etree.fromstring(
        format_parameters(collect_parameters(twin(), names), ParameterFormat.SSV).encode("utf-8")
    )
    assert schema.validate(document), schema.error_log


def test_curves_are_indexed_scalars_with_their_axis() -> None:
    root = ET.fromstring(
        format_parameters(ParameterSet("t", curves=(CURVE,)), ParameterFormat.SSV).encode("utf-8")
    )
    found = {
        one.get("name"): float(one[0].get("value", ""))
        for one in root.iterfind("ssv:Parameters/ssv:Parameter", NAMESPACES)
    }
    assert found == {
        "mu.B3[1]": 0.13,
        "mu.B3[2]": 0.12,
        "mu.B3.slip[1]": 0.0,
        "mu.B3.slip[2]": 20.0,
    }


def test_units_are_declared_once() -> None:
    content = ParameterSet("t", (Scalar("c_o", 280.0, "N*m*s/rad"),), (CURVE,))
    root = ET.fromstring(format_parameters(content, ParameterFormat.SSV).encode("utf-8"))
    declared = {
        unit.get("name"): unit.find("ssc:BaseUnit", NAMESPACES)
        for unit in root.iterfind("ssv:Units/ssc:Unit", NAMESPACES)
    }
    powers = {name: dict(base.attrib) for name, base in declared.items() if base is not None}
    assert powers == {
        "1": {},
        "rad/s": {"rad": "1", "s": "-1"},
        "N*m*s/rad": {"kg": "1", "m": "2", "s": "-1", "rad": "-1"},
    }


def test_indexed_scalars_without_an_axis_stay_scalars_and_other_types_are_named() -> None:
    text = (
        f'<ssv:ParameterSet xmlns:ssv="{NAMESPACES["ssv"]}" version="1.0" name="t">'
        '<ssv:Parameters><ssv:Parameter name="x[1]"><ssv:Real value="1.5"/></ssv:Parameter>'
        '<ssv:Parameter name="on"><ssv:Boolean value="true"/></ssv:Parameter>'
        "</ssv:Parameters></ssv:ParameterSet>"
    )
    found = parse_parameters(text, ParameterFormat.SSV, "t.ssv")
    assert found.scalars == (Scalar("x[1]", 1.5),)
    assert found.skipped == ("on",)


def test_a_curve_is_read_by_its_indices_whatever_their_order_in_the_file() -> None:
    """A tool that sorts by name puts [10] before [2]."""
    points = tuple(float(k) for k in range(12))
    content = ParameterSet("t", (), (Curve("mu", Axis("slip", points), points[::-1]),))
    head, *parameters = format_parameters(content, ParameterFormat.SSV).split("    <ssv:Parameter ")
    *parameters, last = parameters
    last, tail = last.split("  </ssv:Parameters>")
    shuffled = "".join(f"    <ssv:Parameter {one}" for one in sorted([*parameters, last]))
    assert (
        parse_parameters(f"{head}{shuffled}  </ssv:Parameters>{tail}", ParameterFormat.SSV, "t.ssv")
        == content
    )
