# SPDX-License-Identifier: MIT
"""Files that follow from the schema of the elements are those that the tool writes."""

from __future__ import annotations

from tools.elements import METHODS, PAGE, write_methods
from tools.elements_page import fill_page

REMEDY = "write them anew: python -m tools.elements"


def test_the_methods_of_the_builder_are_those_of_the_schema() -> None:
    assert METHODS.read_text(encoding="utf-8") == write_methods(), REMEDY


def test_the_tables_of_the_page_are_those_of_the_schema() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert page == fill_page(page), REMEDY
