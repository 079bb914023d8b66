# SPDX-License-Identifier: MIT
"""Equations of the documents are such that site and code host both draw them."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted((ROOT / "docs").rglob("*.md"))
BLOCK = re.compile(r"^```math\n(.*?)^```", re.MULTILINE | re.DOTALL)


def split(page: Path) -> tuple[list[str], list[str]]:
    """Equations on lines of their own, and those in a line; code is left out."""
    text = page.read_text(encoding="utf-8")
    rest = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    rest = re.sub(r"^ {4}.*$", "", rest, flags=re.MULTILINE)
    return BLOCK.findall(text), re.findall(r"\$([^$]+)\$", re.sub(r"`[^`\n]*`", "", rest))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_an_equation_becomes_mathml(page: Path) -> None:
    converter = pytest.importorskip("latex2mathml.converter")
    blocks, inline = split(page)
    for equation in blocks + inline:
        drawn = converter.convert(equation)
        ElementTree.fromstring(drawn)
        assert "\\" not in drawn, equation  # a command that the converter does not know
        assert "operatorname" not in equation  # not every code host allows it


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_an_equation_in_a_line_has_no_markup(page: Path) -> None:
    """A code host reads Markdown first: it removes escapes and pairs stars and underscores."""
    for equation in split(page)[1]:
        assert not re.search(r"\\[^A-Za-z]|[*<>|\n]|(?:^|[^A-Za-z0-9])_", equation), equation


def test_equations_are_numbered_in_order_and_named_only_if_they_exist() -> None:
    page = ROOT / "docs" / "theory.md"
    blocks, _ = split(page)
    numbers = [(int(a), int(b)) for one in blocks for a, b in re.findall(r"\((\d)\.(\d+)\)", one)]
    assert numbers == sorted(set(numbers))
    text = BLOCK.sub("", page.read_text(encoding="utf-8"))
    named = {(int(a), int(b)) for a, b in re.findall(r"\((\d)\.(\d+)\)", text)}
    assert named
    assert named <= set(numbers)
