# SPDX-License-Identifier: MIT
"""Escapes of characters without a glyph; texts that can be seen stay as they are."""

from __future__ import annotations

import json
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin._util.visible_text import (
    escape_json,
    escape_line,
    escape_text,
)

ANY = st.text(st.characters(exclude_categories=()))


@pytest.mark.parametrize(
    ("text", "shown"),
    [("\x1b[2J", "\\x1b[2J"), ("\x9b31m", "\\x9b31m"), ("a\u202eb", "a\\u202eb"), ("\0", "\\x00"),
     ("\udcff", "\\udcff"), ("\u2066x\u2069", "\\u2066x\\u2069"), ("\U000e0041", "\\U000e0041"),
     ("\x7f", "\\x7f"), ("\u2028", "\\u2028"), ("\r", "\\x0d"), ("\ufeff", "\\ufeff")],
)  # fmt: skip
def test_hidden_characters(text: str, shown: str) -> None:
    assert escape_text(text) == shown


@given(ANY)
def test_nothing_hidden_is_left(text: str) -> None:
    shown = escape_line(text)
    assert not any(unicodedata.category(one)[0] == "C" for one in shown)
    assert escape_line(shown) == shown


@given(st.recursive(ANY | st.none() | st.integers(), lambda one: st.lists(one, max_size=3)))
def test_json_keeps_its_values(value: object) -> None:
    escaped = escape_json(json.dumps(value, ensure_ascii=False))
    assert json.loads(escaped) == json.loads(json.dumps(value))
    assert escape_text(escaped) == escaped
