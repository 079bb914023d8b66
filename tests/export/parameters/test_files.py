# SPDX-License-Identifier: MIT
"""Every format gives back what was written, and refuses what is damaged."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from drivetwin.errors import FileFormatError, InputError
from drivetwin.export.parameters.content import Axis, Curve, ParameterSet
from drivetwin.export.parameters.files import (
    ParameterFormat,
    read_parameters,
)
from drivetwin.export.parameters.of_twin import collect_parameters
from tests.export.parameters.sample import (
    SETS,
    format_parameters,
    parse_parameters,
    reread,
    twin,
)

TEXTS = {kind: format_parameters(collect_parameters(twin()), kind) for kind in ParameterFormat}
EVERY_FORMAT = pytest.mark.parametrize("kind", ParameterFormat)


LIKE_AN_AXIS = ParameterSet(
    "",
    (),
    tuple(
        Curve(name, Axis("0", (0.0, 1.0), "1"), (0.0, 2.0), "1", "") for name in (":", ".", ".0")
    ),
)
"""Curves whose names begin like another's, as that of its axis does."""


@EVERY_FORMAT
@example(LIKE_AN_AXIS)
@given(SETS)
def test_round_trip(kind: ParameterFormat, content: ParameterSet) -> None:
    """Names and texts are respelled once at most; numbers and units stay to the last bit."""
    try:
        held = reread(content, kind)
    except InputError:
        assume(False)
    assert reread(held, kind) == held
    assert [one.value for one in held.scalars] == [one.value for one in content.scalars]
    assert [one.values for one in held.curves] == [one.values for one in content.curves]
    assert [one.axis.points for one in held.curves] == [one.axis.points for one in content.curves]
    assert [one.unit for one in held.entries] == [one.unit for one in content.entries]


@EVERY_FORMAT
def test_names_that_become_one_are_refused(kind: ParameterFormat) -> None:
    content = collect_parameters(twin())
    doubled = ParameterSet("twice", content.scalars[:1] * 2)
    with pytest.raises(InputError, match="both written as"):
        format_parameters(doubled, kind)


@pytest.mark.parametrize(
    ("kind", "other"), [(ParameterFormat.SSV, "mu.B3.slip"), (ParameterFormat.M, "mu.B3_slip")]
)
def test_the_name_of_an_axis_is_nobody_elses(kind: ParameterFormat, other: str) -> None:
    """Where the axis is written beside its curve, either would be read for the other."""
    curves = tuple(
        Curve(name, Axis(axis, (0.0, 1.0)), (2.0, 3.0))
        for name, axis in (("mu.B3", "slip"), (other, "v"))
    )
    with pytest.raises(InputError, match=r"the axis of 'mu\.B3' are both written as"):
        format_parameters(ParameterSet("t", (), curves), kind)


@EVERY_FORMAT
@pytest.mark.parametrize("text", ["", "\n", "<a/>", "{}", "a,b\n1,2\n", "x = ;", "\u00e4 = \u00b5"])
def test_what_is_no_parameter_file_is_refused(kind: ParameterFormat, text: str) -> None:
    with pytest.raises(FileFormatError):
        parse_parameters(text, kind)


@EVERY_FORMAT
@pytest.mark.parametrize("wrong", ["nan", "inf", "0,85"])
def test_a_value_that_is_no_finite_number_is_refused(kind: ParameterFormat, wrong: str) -> None:
    text = TEXTS[kind]
    assert text.count("176000.0") == 1
    with pytest.raises(FileFormatError):
        parse_parameters(text.replace("176000.0", wrong), kind)


@EVERY_FORMAT
def test_a_curve_that_lost_a_point_is_refused(kind: ParameterFormat) -> None:
    content = collect_parameters(twin())
    text = TEXTS[kind]
    last = repr(content.curves[0].axis.points[-1])
    repeated = repr(content.curves[0].axis.points[-2])
    assert text.count(last) >= 1
    with pytest.raises(FileFormatError, match=r"do not increase|axis points for"):
        parse_parameters(text.replace(last, repeated), kind)


@EVERY_FORMAT
@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.text(max_size=5))
@example(0.0, 0.0, '"')
def test_a_damaged_file_is_read_or_refused_never_a_crash(
    kind: ParameterFormat, start: float, length: float, inserted: str
) -> None:
    text = TEXTS[kind]
    first = int(start * len(text))
    damaged = text[:first] + inserted + text[first + int(length**6 * len(text)) :]
    with suppress(FileFormatError):
        parse_parameters(damaged, kind)


def test_a_format_is_known_by_its_ending(tmp_path: Path) -> None:
    path = tmp_path / "parameters.xyz"
    path.write_text("", "utf-8")
    with pytest.raises(InputError, match="use one of ssv, cdfx, dcm, m, csv"):
        read_parameters(path)


def test_binary_is_refused_and_latin_1_is_read(tmp_path: Path) -> None:
    path = tmp_path / "old.dcm"
    path.write_bytes(b"\0\1")
    with pytest.raises(FileFormatError, match="binary"):
        read_parameters(path)
    text = 'KONSERVIERUNG_FORMAT 2.0\nFESTWERT T\n  EINHEIT_W "\xb0C"\n  WERT 20\nEND\n'
    path.write_bytes(text.encode("latin-1"))
    assert read_parameters(path).scalars[0].unit == "\xb0C"
