# SPDX-License-Identifier: MIT
"""CSV rows: texts that a spreadsheet would compute are protected and read back, numbers stay."""

from __future__ import annotations

import csv
import math
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin._util.csv_text import NumberText, format_csv_row, parse_csv_row, restore_cell

COMPUTED = [
    "=1+1", "=cmd|' /C calc'!A0", "@SUM(A1)", "+1", "-1", "-", "\t=1", "\r=1", "'=1", "''@x",
    "-2+3",    '=HYPERLINK("http://evil")', "=a,b",
]  # fmt: skip


@pytest.mark.parametrize("text", COMPUTED)
def test_protected_and_quoted(text: str) -> None:
    row = format_csv_row([text, 1.5])
    assert row.startswith("\"'")
    (cells,) = csv.reader([row])
    assert cells == [f"'{text}", "1.5"]
    assert parse_csv_row(row)[0] == text


@pytest.mark.parametrize("text", ["", "a=b", "'", "'a", "torque", "N*m", "1-2", "a,b", 'a"b'])
def test_other_texts_stay(text: str) -> None:
    (cells,) = csv.reader([format_csv_row([text, "x"])])
    assert cells == [text, "x"]


def test_numbers_are_untouched() -> None:
    cells = [-1.5, -2, 1e-300, math.inf, -math.inf, True, None, Decimal("-1.5"), NumberText("-1.0")]
    assert format_csv_row(cells) == "-1.5,-2,1e-300,inf,-inf,True,,-1.5,-1.0\n"


@given(st.lists(st.text(st.characters(codec="utf-8")), min_size=1))
def test_rows_read_back(cells: list[str]) -> None:
    row = format_csv_row([*cells, 0])
    (found,) = csv.reader([row])
    assert [restore_cell(cell) for cell in found] == [*cells, "0"]
    assert all(cell[:1] not in ("=", "+", "-", "@", "\t", "\r") or not cell for cell in found)
