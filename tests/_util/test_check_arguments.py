# SPDX-License-Identifier: MIT
"""Arguments of public functions: texts for enums, and wrong types by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import drivetwin
from drivetwin.errors import InputError
from drivetwin.export.parameters.content import ParameterSet, Scalar
from drivetwin.export.parameters.files import read_parameters, write_parameters
from drivetwin.shifts.detect import FoundShifts
from tests.report.sample import card
from tests.shifts.fixtures import make_log


def test_a_text_becomes_the_member_that_it_names(tmp_path: Path) -> None:
    path, kind = tmp_path / "k.dat", "csv"
    content = ParameterSet("k", (Scalar("k", 1.0),))
    write_parameters(content, path, kind)  # type: ignore[arg-type]
    assert read_parameters(path, kind=kind) == content  # type: ignore[arg-type]


@pytest.mark.parametrize("text", ["ml", "likelyhood", 3])
def test_another_text_is_refused_with_the_accepted_ones(text: Any) -> None:
    with pytest.raises(InputError, match=r"method is .*one of 'paper', 'likelihood'") as fault:
        drivetwin.identify(make_log({}), card(), FoundShifts((), ()), text)
    assert "one of" in fault.value.remedy


def test_a_wrong_type_is_refused_with_the_way_to_get_the_right_one() -> None:
    log: Any = Path("log.csv")
    with pytest.raises(InputError, match=r"log is a \w*Path, not a ShiftLog\n.*read_log"):
        drivetwin.detect_shifts(log, card())
    with pytest.raises(InputError, match=r"card is a dict, not a VehicleCard\n.*load_card"):
        drivetwin.detect_shifts(make_log({}), {})  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="missing a required argument"):
        drivetwin.detect_shifts()  # type: ignore[call-arg]
