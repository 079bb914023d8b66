# SPDX-License-Identifier: MIT
"""Words of the Modelica language."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.export.modelica.component import (
    format_matrix,
    format_string,
    make_identifier,
    make_identifiers,
)


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("B3", "B3"),
        ("output shaft", "output_shaft"),
        ("2-3", "x_2_3"),
        ("input", "x_input"),
        ("Jµ′", "Jmu_"),
        ("", "x_"),
    ],
)
def test_identifiers_are_plain(name: str, word: str) -> None:
    assert make_identifier(name) == word


@given(st.lists(st.text(max_size=8), unique=True, max_size=8))
def test_identifiers_are_legal_and_differ(names: list[str]) -> None:
    found = make_identifiers(names)
    assert list(found) == names
    assert len(set(found.values())) == len(names)
    assert all(re.fullmatch("[A-Za-z][A-Za-z0-9_]*", word) for word in found.values())


def test_literals() -> None:
    assert format_matrix([(0.0, 1e-5), (2.0, -3.0)]) == "[0.0, 1.0e-05;\n      2.0, -3.0]"
    assert format_string('a "b" \\c\n') == "\"a 'b' /c\""
