# SPDX-License-Identifier: MIT
"""CDFX against an example written by hand, and as calibration tools save it."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import pytest

from drivetwin.export.parameters.content import Axis, Curve, ParameterSet, Scalar
from drivetwin.export.parameters.files import ParameterFormat
from drivetwin.export.parameters.of_twin import collect_parameters
from drivetwin.export.targets import Names
from tests.export.parameters.sample import format_parameters, parse_parameters, twin

CONTENT = ParameterSet(
    "truck <1>",
    (Scalar("P0.B3", 82000.0, "Pa", "fill ends"),),
    (Curve("mu.B3", Axis("slip", (0.0, 20.0), "rad/s"), (0.13, 0.12), text="friction"),),
    notes=("a -- b",),
)

EXPECTED = """<?xml version="1.0" encoding="UTF-8"?>
<!DOCTYPE MSRSW PUBLIC "-//ASAM//DTD CALIBRATION DATA FORMAT:V2.0.0:LAI:IAI:XML:CDF200.XSD//EN" \
"cdf_v2.0.0.sl.dtd">
<!--
  a - - b
-->
<MSRSW CREATOR="drivetwin">
  <SHORT-NAME>truck__1_</SHORT-NAME>
  <CATEGORY>CDF20</CATEGORY>
  <SW-SYSTEMS>
    <SW-SYSTEM>
      <SHORT-NAME>truck__1_</SHORT-NAME>
      <LONG-NAME>truck &lt;1&gt;</LONG-NAME>
      <SW-INSTANCE-SPEC>
        <SW-INSTANCE-TREE>
          <SHORT-NAME>drivetwin</SHORT-NAME>
          <CATEGORY>NO_VCD</CATEGORY>
          <SW-INSTANCE>
            <SHORT-NAME>P0.B3</SHORT-NAME>
            <LONG-NAME>fill ends</LONG-NAME>
            <CATEGORY>VALUE</CATEGORY>
            <SW-VALUE-CONT>
              <UNIT-DISPLAY-NAME>Pa</UNIT-DISPLAY-NAME>
              <SW-VALUES-PHYS>
                <V>82000.0</V>
              </SW-VALUES-PHYS>
            </SW-VALUE-CONT>
          </SW-INSTANCE>
          <SW-INSTANCE>
            <SHORT-NAME>mu.B3</SHORT-NAME>
            <LONG-NAME>friction (over slip)</LONG-NAME>
            <CATEGORY>CURVE</CATEGORY>
            <SW-VALUE-CONT>
              <UNIT-DISPLAY-NAME>-</UNIT-DISPLAY-NAME>
              <SW-VALUES-PHYS>
                <V>0.13</V>
                <V>0.12</V>
              </SW-VALUES-PHYS>
            </SW-VALUE-CONT>
            <SW-AXIS-CONTS>
              <SW-AXIS-CONT>
                <CATEGORY>STD_AXIS</CATEGORY>
                <UNIT-DISPLAY-NAME>rad/s</UNIT-DISPLAY-NAME>
                <SW-VALUES-PHYS>
                  <V>0.0</V>
                  <V>20.0</V>
                </SW-VALUES-PHYS>
              </SW-AXIS-CONT>
            </SW-AXIS-CONTS>
          </SW-INSTANCE>
        </SW-INSTANCE-TREE>
      </SW-INSTANCE-SPEC>
    </SW-SYSTEM>
  </SW-SYSTEMS>
</MSRSW>
"""

WITH_VARIANTS = """<MSRSW><SHORT-NAME>d</SHORT-NAME><CATEGORY>CDF20</CATEGORY><SW-SYSTEMS>
<SW-SYSTEM><SHORT-NAME>s</SHORT-NAME><SW-INSTANCE-SPEC><SW-INSTANCE-TREE><SHORT-NAME>t</SHORT-NAME>
<CATEGORY>VCD</CATEGORY>
<SW-INSTANCE><SHORT-NAME>A</SHORT-NAME><CATEGORY>VALUE</CATEGORY><SW-INSTANCE-PROPS-VARIANTS>
<SW-INSTANCE-PROPS-VARIANT><SW-VALUE-CONT><UNIT-DISPLAY-NAME>Nm</UNIT-DISPLAY-NAME>
<SW-VALUES-PHYS><V>12.5000</V></SW-VALUES-PHYS></SW-VALUE-CONT></SW-INSTANCE-PROPS-VARIANT>
</SW-INSTANCE-PROPS-VARIANTS></SW-INSTANCE>
<SW-INSTANCE><SHORT-NAME>B</SHORT-NAME><CATEGORY>VAL_BLK</CATEGORY><SW-VALUE-CONT>
<SW-ARRAYSIZE><V>2</V></SW-ARRAYSIZE><SW-VALUES-PHYS><VG><V>1</V><V>2</V></VG></SW-VALUES-PHYS>
</SW-VALUE-CONT></SW-INSTANCE>
<SW-INSTANCE><SHORT-NAME>C</SHORT-NAME><CATEGORY>CURVE</CATEGORY><SW-VALUE-CONT><SW-VALUES-PHYS>
<V>3</V><V>4</V></SW-VALUES-PHYS></SW-VALUE-CONT><SW-AXIS-CONTS><SW-AXIS-CONT>
<CATEGORY>COM_AXIS</CATEGORY><SW-INSTANCE-REF>X</SW-INSTANCE-REF></SW-AXIS-CONT></SW-AXIS-CONTS>
</SW-INSTANCE>
<SW-INSTANCE><SHORT-NAME>D</SHORT-NAME><CATEGORY>CURVE</CATEGORY><SW-VALUE-CONT><SW-VALUES-PHYS>
<V>3</V><V>4</V></SW-VALUES-PHYS></SW-VALUE-CONT><SW-AXIS-CONTS><SW-AXIS-CONT>
<CATEGORY>COM_AXIS</CATEGORY><SW-INSTANCE-REF>Y</SW-INSTANCE-REF></SW-AXIS-CONT></SW-AXIS-CONTS>
</SW-INSTANCE>
<SW-INSTANCE><SHORT-NAME>Y</SHORT-NAME><CATEGORY>COM_AXIS</CATEGORY><SW-VALUE-CONT>
<UNIT-DISPLAY-NAME>rpm</UNIT-DISPLAY-NAME><SW-VALUES-PHYS><V>1</V><V>2.5</V></SW-VALUES-PHYS>
</SW-VALUE-CONT></SW-INSTANCE>
</SW-INSTANCE-TREE></SW-INSTANCE-SPEC></SW-SYSTEM></SW-SYSTEMS></MSRSW>"""


def test_curves_of_one_axis_refer_to_it() -> None:
    speeds = Axis("engine_speed", (100.0, 200.0), "rad/s")
    both = tuple(Curve(name, speeds, (1.0, 2.0), "s", "ramp") for name in "ab")
    content = ParameterSet("map", (), (*both, *CONTENT.curves))
    text = format_parameters(content, ParameterFormat.CDFX)
    assert text.count("<SHORT-NAME>engine_speed_axis_1</SHORT-NAME>") == text.count("100.0") == 1
    assert text.count("<SW-INSTANCE-REF>engine_speed_axis_1</SW-INSTANCE-REF>") == 2
    assert parse_parameters(text, ParameterFormat.CDFX, "map.cdfx") == content


_CDF_CHILDREN = {
    "MSRSW": ["SHORT-NAME", "CATEGORY", "SW-SYSTEMS"],
    "SW-SYSTEMS": ["SW-SYSTEM"],
    "SW-SYSTEM": ["SHORT-NAME", "LONG-NAME", "CATEGORY", "SW-INSTANCE-SPEC"],
    "SW-INSTANCE-SPEC": ["SW-INSTANCE-TREE"],
    "SW-INSTANCE-TREE": ["SHORT-NAME", "LONG-NAME", "CATEGORY", "SW-INSTANCE"],
    "SW-INSTANCE": [
        *("SHORT-NAME", "LONG-NAME", "DISPLAY-NAME", "CATEGORY", "SW-FEATURE-REF"),
        *("SW-VALUE-CONT", "SW-AXIS-CONTS"),
    ],
    "SW-VALUE-CONT": ["UNIT-DISPLAY-NAME", "SW-ARRAYSIZE", "SW-VALUES-PHYS"],
    "SW-AXIS-CONTS": ["SW-AXIS-CONT"],
    "SW-AXIS-CONT": [
        *("CATEGORY", "UNIT-DISPLAY-NAME", "SW-ARRAYSIZE", "SW-VALUES-PHYS", "SW-INSTANCE-REF")
    ],
    "SW-VALUES-PHYS": ["V"],
}
"""Children in the order of the ASAM DTD, as far as used; the DTD itself may not be passed on."""
_REPEATED = ("SW-INSTANCE", "V")


def test_the_text_is_that_of_the_example() -> None:
    assert format_parameters(CONTENT, ParameterFormat.CDFX) == EXPECTED
    assert parse_parameters(EXPECTED, ParameterFormat.CDFX, "truck.cdfx") == CONTENT


def test_variants_are_read_and_other_objects_are_named() -> None:
    found = parse_parameters(WITH_VARIANTS, ParameterFormat.CDFX, "demo.cdfx")
    assert found.scalars == (Scalar("A", 12.5, "Nm"),)
    assert found.curves == (Curve("D", Axis("x", (1.0, 2.5), "rpm"), (3.0, 4.0)),)
    assert found.skipped == ("VAL_BLK B", "CURVE C")
    assert found.name == "demo"


@pytest.mark.parametrize("names", Names)
def test_cdfx_children_stand_in_the_prescribed_order(names: Names) -> None:
    root = ET.fromstring(
        format_parameters(collect_parameters(twin(), names), ParameterFormat.CDFX).encode("utf-8")
    )
    for element in root.iter():
        allowed = _CDF_CHILDREN.get(element.tag, [])
        found = [child.tag for child in element]
        assert found == sorted(found, key=allowed.index), element.tag
        assert all(found.count(tag) == 1 or tag in _REPEATED for tag in found), element.tag
