# SPDX-License-Identifier: MIT
"""Escapes of characters without a glyph; texts that can be seen stay as they are."""

from __future__ import annotations

import json
import unicodedata

from hypothesis import given
from hypothesis import strategies as st

from drivetwin._util.text import escape_json, escape_line

ANY = st.text(st.characters(exclude_categories=()))


@given(ANY)
def test_nothing_hidden_is_left(text: str) -> None:
    shown = escape_line(text)
    assert not any(unicodedata.category(one)[0] == "C" for one in shown)
    assert escape_line(shown) == shown


@given(st.recursive(ANY | st.none() | st.integers(), lambda one: st.lists(one, max_size=3)))
def test_json_keeps_its_values(value: object) -> None:
    escaped = escape_json(json.dumps(value, ensure_ascii=False))
    assert json.loads(escaped) == json.loads(json.dumps(value))
    assert escape_line(escaped) == escaped
