# SPDX-License-Identifier: MIT
"""DCM against an example written by hand, its quoting rules, and as calibration tools save it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from dcmReader.dcm_reader import DcmReader
from hypothesis import assume, given

from drivetwin.errors import FileFormatError, InputError
from drivetwin.export.parameters.content import Axis, Curve, ParameterSet, Scalar
from drivetwin.export.parameters.files import ParameterFormat, show_units
from drivetwin.export.parameters.of_twin import collect_parameters
from drivetwin.export.targets import Names
from tests.export.parameters.sample import SETS, format_parameters, parse_parameters, twin

CONTENT = ParameterSet(
    "Überland-LKW",
    (Scalar("P0.B-3", 1e-05, "Pa", 'öffnet bei "0" µ'),),
    (Curve("mu", Axis("slip", tuple(range(8)), "rad/s"), tuple(range(10, 18))),),
)

EXPECTED = """
KONSERVIERUNG_FORMAT 2.0

FUNKTIONEN
  FKT Uberland_LKW "" "Uberland-LKW"
END

FESTWERT P0.B_3
  LANGNAME "offnet bei '0' mu (P0.B-3)"
  FUNKTION Uberland_LKW
  EINHEIT_W "Pa"
  WERT 1.0e-05
END

KENNLINIE mu 8
  LANGNAME "(over slip)"
  FUNKTION Uberland_LKW
  EINHEIT_X "rad/s"
  EINHEIT_W "-"
  ST/X 0.0 1.0 2.0 3.0 4.0 5.0
  ST/X 6.0 7.0
  WERT 10.0 11.0 12.0 13.0 14.0 15.0
  WERT 16.0 17.0
END
"""

FROM_A_TOOL = """* from a tool
KONSERVIERUNG_FORMAT 2.0
FUNKTIONEN
   FKT Trans "1.0" "Transmission"
   FKT Other "" ""
END

FESTWERT  K_P0
   LANGNAME   "fill pressure"
   DISPLAYNAME P0
   EINHEIT_W  "bar"
   WERT  0.82
END

FESTWERT K_Text
   TEXT "on"
END

GRUPPENKENNLINIE KL_Mu 3
   LANGNAME "friction"
   EINHEIT_X "1/min"
   EINHEIT_W ""
*SSTX SST_Slip
   ST/X   0.0   10.0   20.0
   WERT   0.13  0.12   .11
END

KENNFELD KF_Any 2 1
   ST/X 0 1
   ST/Y 0
   WERT 1 2
END
"""

_NUMBER = r"-?\d+\.\d+(?:e[+-]\d+)?"
_NAME = r"[A-Za-z_][A-Za-z0-9_.]*"
_TEXT = r'"[^"\\]*"'
_LINES = re.compile(
    rf"|\*.*|KONSERVIERUNG_FORMAT 2\.0|FUNKTIONEN|END|  FKT {_NAME} {_TEXT} {_TEXT}"
    rf"|FESTWERT {_NAME}|KENNLINIE {_NAME} \d+|  (?:LANGNAME|EINHEIT_[XW]) {_TEXT}"
    rf"|  FUNKTION {_NAME}|  (?:WERT|ST/X)(?: {_NUMBER}){{1,6}}"
)


def test_the_text_is_that_of_the_example() -> None:
    assert format_parameters(CONTENT, ParameterFormat.DCM) == EXPECTED


@given(SETS)
def test_every_line_follows_the_grammar(content: ParameterSet) -> None:
    try:
        text = format_parameters(content, ParameterFormat.DCM)
    except InputError:
        assume(False)
    assert text.isascii()
    for line in text.split("\n"):
        assert _LINES.fullmatch(line), line


def test_what_a_tool_writes_is_read_and_other_objects_are_named() -> None:
    found = parse_parameters(FROM_A_TOOL, ParameterFormat.DCM, "transmission.dcm")
    assert found.name == "Transmission"
    assert found.scalars == (Scalar("K_P0", 0.82, "bar", "fill pressure"),)
    axis = Axis("x", (0.0, 10.0, 20.0), "1/min")
    assert found.curves == (Curve("KL_Mu", axis, (0.13, 0.12, 0.11), text="friction"),)
    assert found.skipped == ("FESTWERT K_Text", "KENNFELD KF_Any")


def test_curves_share_an_axis_and_people_read_few_digits() -> None:
    speeds = Axis("engine_speed", (100.0, 200.0), "rad/s")
    both = [Curve(name, speeds, (1e5 / 3.0, 2e5), "Pa", "kiss", 10.0, (0.0, 3e5)) for name in "ab"]
    text = format_parameters(show_units(ParameterSet("map", (), tuple(both)), ParameterFormat.DCM),
                             ParameterFormat.DCM)  # fmt: skip
    assert text.count("STUETZSTELLENVERTEILUNG engine_speed_axis_1 2") == 1
    assert text.count("*SSTX engine_speed_axis_1") == text.count("GRUPPENKENNLINIE") == 2
    read = parse_parameters(text, ParameterFormat.DCM)
    assert read.skipped == ()
    for one in read.curves:
        assert one.values == (0.3333, 2.0)
        assert one.axis.points == (954.93, 1909.859)
        assert one.text.startswith("kiss, 0 to 3")


def test_an_object_without_end_is_refused_by_name() -> None:
    with pytest.raises(FileFormatError, match="K_P0"):
        parse_parameters(
            FROM_A_TOOL.replace("WERT  0.82\nEND", "WERT  0.82"), ParameterFormat.DCM, "cut.dcm"
        )


@pytest.mark.parametrize("names", Names)
def test_another_reader_finds_the_same_in_the_dcm(names: Names, tmp_path: Path) -> None:
    content = collect_parameters(twin(), names)
    path = tmp_path / "twin.dcm"
    path.write_text(format_parameters(content, ParameterFormat.DCM), "ascii")
    reader = DcmReader()
    reader.read(str(path))
    numbers = {one.name: (one.value, one.unit) for one in reader.get_parameters()}
    assert numbers == {
        one.name: (one.value, "-" if one.unit == "1" else one.unit) for one in content.scalars
    }
    (line,) = reader.get_characteristic_lines()
    (curve,) = content.curves
    assert (line.name, line.unit_x, line.unit_values) == (curve.name, curve.axis.unit, "-")
    assert list(line.values.items()) == list(zip(curve.axis.points, curve.values, strict=True))
