# SPDX-License-Identifier: MIT
"""TOML at the border: nesting, integers and texts beyond the limits are typed errors."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin import load_card
from drivetwin._util.toml import parse_toml
from drivetwin.errors import DrivetwinError
from drivetwin.export.parameters.files import read_template

MAX_DEPTH, MAX_TEXT, MAX_SIZE = 50, 100_000, 4_000_000
"""Limits of nesting, of a text [characters] and of a file [bytes]."""
BOMBS = {
    "arrays": "x = " + 100_000 * "[" + 100_000 * "]",
    "open arrays": "x = " + 1_000_000 * "[",
    "some arrays": "x = " + (MAX_DEPTH + 1) * "[" + (MAX_DEPTH + 1) * "]",
    "inline tables": "x = " + 100_000 * "{a = " + "1" + 100_000 * "}",
    "dotted key": ".".join(1_000_000 * ["a"]) + " = 1",
    "quoted dotted key": " . ".join(300_000 * ["'a.b'"]) + " = 1",
    "dotted header": "[" + ".".join(100_000 * ["a"]) + "]",
    "dotted inline": "x = {" + ".".join(100_000 * ['"a"']) + " = 1}",
    "long integer": "x = " + 1_000_000 * "9",
    "integer": "x = " + 4_000 * "9",
    "hexadecimal integer": "x = 0x" + 100_000 * "F",
    "integer of 64 bits": f"x = {2**63}",
    "denormal number": "x = 1e-320",
    "small number": "x = [-1e-151]",
    "large number": "x = 1e151",
    "text": f'x = "{(MAX_TEXT + 1) * "x"}"',
    "text of the name": f'name = "{1_000_000 * "x"}"',
    "key": (MAX_TEXT + 1) * "x" + " = 1",
    "size": "# " + MAX_SIZE * "x",
    "NUL": "x = 'a\0b'",
    "no UTF-8": "x = '\udcff'",
}


@pytest.mark.parametrize("bomb", BOMBS)
@pytest.mark.parametrize("reader", [load_card, read_template])
def test_bombs_are_typed_errors(
    tmp_path: Path, reader: Callable[[Path], object], bomb: str
) -> None:
    path = tmp_path / "file.toml"
    path.write_text(BOMBS[bomb], encoding="utf-8", errors="surrogateescape")
    started = time.process_time()
    with pytest.raises(DrivetwinError) as caught:
        reader(path)
    assert time.process_time() - started < 5.0
    assert re.search("TOML|read|UTF-8|schema", caught.value.what)
    assert len(str(caught.value)) < 2_000


@given(st.recursive(st.integers(-9, 9), lambda one: st.lists(one, max_size=3), max_leaves=9))
def test_documents_within_the_limits_are_read(value: object) -> None:
    assert parse_toml(f"x = {value}") == {"x": value}


def test_the_limits_themselves_are_allowed() -> None:
    text = MAX_TEXT * "x"
    assert parse_toml(f"x = '{text}'\ny = {2**63 - 1}\nz = {-(2**63)}") == {
        "x": text,
        "y": 2**63 - 1,
        "z": -(2**63),
    }
    depth = MAX_DEPTH - 1
    assert parse_toml(f"x = {depth * '['}{depth * ']'}")
