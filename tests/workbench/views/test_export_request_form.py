# SPDX-License-Identifier: MIT
"""Choices of a request: one for each closed set, checked when they come back."""

from __future__ import annotations

import pytest

from drivetwin._util.request import get_arguments
from drivetwin.errors import RefusedError
from drivetwin.export.targets import FmiVersion, Names
from drivetwin.export.write import ExportOptions
from drivetwin.workbench.views.export import build_choices, parse_choices
from drivetwin.workbench.views.fields import ControlId
from tests.workbench.views.texts import iterate_texts

IDS = [ControlId(id="names"), ControlId(id="fmi")]


def test_each_closed_set_has_a_choice_with_the_help_of_its_option() -> None:
    shown = build_choices(ExportOptions)
    assert len(shown) == 2
    words = [text for one in shown for text in iterate_texts(one)]
    arguments = get_arguments(ExportOptions)
    assert words == [
        *(arguments["names"].help, *Names),
        *(arguments["fmi"].help, *FmiVersion),
    ]


def test_values_come_back_as_members() -> None:
    found = parse_choices(ExportOptions, ["simscape", "3.0"], IDS)
    assert found == {"names": Names.SIMSCAPE, "fmi": FmiVersion.FMI3}


@pytest.mark.parametrize("values", [["simscape", "4.0"], ["simscape"], ["", "3.0"]])
def test_other_values_are_refused(values: list[str]) -> None:
    with pytest.raises(RefusedError, match="no such choice"):
        parse_choices(ExportOptions, values, IDS)
    with pytest.raises(RefusedError, match="no such choice"):
        parse_choices(ExportOptions, ["c"], [ControlId(id="nothing")])
