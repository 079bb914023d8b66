# SPDX-License-Identifier: MIT
"""The table of names: complete, and compared without case, separators and umlauts."""

from __future__ import annotations

import re
import unicodedata

from hypothesis import given
from hypothesis import strategies as st

from drivetwin.channels.names import load_name_table, normalise_name
from drivetwin.channels.roles import EXTRA_ROLES, ROLES


def test_every_role_has_names_and_every_word_its_own_form() -> None:
    table = load_name_table()
    assert set(table.patterns) == {*ROLES, *EXTRA_ROLES} == set(table.hints)
    assert all(re.compile(pattern) for pattern in table.patterns.values())
    for words in table.words.values():
        assert all(words)
        assert len(set(words)) == len(words)


def test_hints_are_no_names() -> None:
    table = load_name_table()
    for role, hints in table.hints.items():
        assert not any(re.fullmatch(table.patterns[role], name) for name in hints)


@given(st.text("aäöüßmnrpk0129", min_size=1), st.data())
def test_case_separators_and_form_of_umlauts_do_not_count(name: str, data: st.DataObject) -> None:
    separators = st.sampled_from(["", "_", " ", "-", ".", "·"])
    gaps = data.draw(st.lists(separators, min_size=len(name), max_size=len(name)))
    other = "".join(gap + letter for gap, letter in zip(gaps, name, strict=True))
    change = data.draw(st.sampled_from([str.upper, str.lower, str.title]))
    for form in (change(other), unicodedata.normalize("NFD", change(other))):
        assert normalise_name(form) == normalise_name(name)


@given(st.text())
def test_any_name_has_a_form_that_stays(name: str) -> None:
    once = normalise_name(name)
    assert re.fullmatch("[a-z0-9]*", once)
    assert normalise_name(once) == once
