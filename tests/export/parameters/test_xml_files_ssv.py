# SPDX-License-Identifier: MIT
"""SSV: valid against the schema of SSP 1.0; curves as indexed scalars, units as base units."""

from __future__ import annotations

from pathlib import Path

import fmpy
import pytest
from lxml import etree

from drivetwin.export.parameters.content import Axis, Curve, ParameterSet, Scalar
from drivetwin.export.parameters.files import ParameterFormat
from drivetwin.export.parameters.of_twin import collect_parameters
from drivetwin.export.targets import Names
from tests.export.parameters.sample import format_parameters, parse_parameters, twin

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
