# SPDX-License-Identifier: MIT
"""Tables as text: within the width, and no word is cut."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from drivetwin.report.blocks import Cell, TableBlock, make_table
from drivetwin.report.text import format_blocks

WORDS = st.text("abcdefgh_.0123456789±", min_size=1, max_size=24)
TEXTS = st.lists(WORDS, min_size=1, max_size=6).map(" ".join)
WIDTH = 80


@st.composite
def tables(draw: st.DrawFn) -> TableBlock:
    """Tables of texts, numbers and notes with up to nine columns."""
    count = draw(st.integers(1, 9))
    columns = [draw(st.one_of(TEXTS, st.tuples(TEXTS, st.just("s")))) for _ in range(count)]
    cells = [
        WORDS if isinstance(one, tuple) else st.builds(Cell, TEXTS, note=TEXTS) for one in columns
    ]
    rows = draw(st.lists(st.tuples(*cells), min_size=1, max_size=4))
    return make_table("", columns, rows)


@given(table=tables())
def test_a_table_fits_and_its_words_are_whole(table: TableBlock) -> None:
    shown = format_blocks([table], WIDTH)
    assert max(map(len, shown.splitlines())) <= WIDTH
    words = set(shown.split())
    for row in (table.head, *table.rows):
        for cell in row:
            assert words.issuperset(word for text in cell.texts for word in text.split())


def test_a_divided_table_repeats_its_first_column() -> None:
    table = make_table("", ["name", "a" * 30, "b" * 30, "c" * 30], [("x", "1", "2", "3")])
    shown = format_blocks([table], WIDTH)
    assert shown.count("name") == 2
    assert shown.count("x  ") == 2


def test_a_word_wider_than_the_terminal_is_the_only_one_that_is_cut() -> None:
    shown = format_blocks([make_table("", ["path", "n"], [("p" * 100, "whole")])], WIDTH)
    assert max(map(len, shown.splitlines())) <= WIDTH
    assert "whole" in shown
    assert shown.count("p") == 101
