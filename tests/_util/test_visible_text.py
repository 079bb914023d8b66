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
    escape_values,
    show_json_escapes,
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


@pytest.mark.parametrize(
    "text", ["", "plain", "µ·η·Ω → 12\u00a0%", "漢字", "é", "Ρ0 (Greek)", "a\\n"]
)
def test_what_can_be_seen_stays(text: str) -> None:
    assert escape_line(text) == text


def test_line_ends_stay_in_texts_and_not_in_lines() -> None:
    assert escape_text("a\n\tb") == "a\n\tb"
    assert escape_line("a\n\tb") == "a\\x0a\\x09b"


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


@given(st.lists(ANY))
def test_json_for_a_browser_shows_escapes(texts: list[str]) -> None:
    for ascii_only in (True, False):
        document = show_json_escapes(json.dumps(texts, ensure_ascii=ascii_only))
        for shown in json.loads(document):
            assert not any(one in shown for one in "\x00\x1b\x7f\x9b\u202e\u2066\u200b\u2028\ufeff")


def test_keys_and_texts_of_values() -> None:
    assert escape_values({"\x1b": ["\u202e", 1, None, ("a",)]}) == {
        "\\x1b": ["\\u202e", 1, None, ["a"]]
    }
