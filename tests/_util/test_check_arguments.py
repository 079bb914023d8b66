# SPDX-License-Identifier: MIT
"""Arguments of public functions: texts for enums, and wrong types by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import drivetwin
from drivetwin._util.check_arguments import check_arguments
from drivetwin.errors import InputError
from drivetwin.estimation.result.method import Method
from drivetwin.shifts.detect import FoundShifts
from drivetwin.simulation.dual_clutch import LossLaw
from tests.report.sample import card
from tests.shifts.fixtures import make_log


@check_arguments
def take(method: Method, law: LossLaw | None = None, size: float = 1.0) -> Any:
    return method, law, size


def test_a_text_becomes_the_member_that_it_names() -> None:
    assert take("likelihood") == (Method.LIKELIHOOD, None, 1.0)  # type: ignore[arg-type]
    assert take(Method.PAPER, "dissipative", size=2.0) == (Method.PAPER, "dissipative", 2.0)


@pytest.mark.parametrize("text", ["ml", "likelyhood", 3])
def test_another_text_is_refused_with_the_accepted_ones(text: Any) -> None:
    with pytest.raises(
        InputError, match=r"method is .*one of 'paper', 'integral', 'likelihood'"
    ) as e:
        take(text)
    assert "one of" in e.value.remedy


def test_a_closed_set_of_texts_is_checked_too() -> None:
    with pytest.raises(InputError, match="'paper', 'dissipative'"):
        take(Method.PAPER, "lossless")  # type: ignore[arg-type]


def test_a_wrong_type_is_refused_with_the_way_to_get_the_right_one() -> None:
    log: Any = Path("log.csv")
    with pytest.raises(InputError, match=r"log is a \w*Path, not a ShiftLog\n.*read_log"):
        drivetwin.detect_shifts(log, card())
    with pytest.raises(InputError, match=r"card is a dict, not a VehicleCard\n.*load_card"):
        drivetwin.detect_shifts(make_log({}), {})  # type: ignore[arg-type]


def test_python_names_the_number_of_arguments_itself() -> None:
    with pytest.raises(TypeError, match="missing a required argument"):
        take()  # type: ignore[call-arg]


def test_the_method_of_an_identification_is_refused_before_it_begins() -> None:
    shifts = FoundShifts((), ())
    with pytest.raises(InputError, match="method is 'ml'"):
        drivetwin.identify(make_log({}), card(), shifts, "ml")  # type: ignore[arg-type]


Signal = tuple[float, float]
"""An alias with the name of a class that is checked elsewhere."""


@check_arguments
def take_pair(pair: Signal) -> Signal:
    return pair


def test_an_alias_of_the_same_name_is_not_taken_for_the_class() -> None:
    assert take_pair((1.0, 2.0)) == (1.0, 2.0)
