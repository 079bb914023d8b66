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


def test_a_new_type_gets_its_section_behind_the_type_before_it() -> None:
    page = PAGE.read_text(encoding="utf-8")
    start, end = page.index("\n## spring_table"), page.index("\n## backlash")
    filled = fill_page(page[:start] + page[end:])
    section = filled[filled.index("\n## spring_table") : filled.index("\n## backlash")]
    assert section.endswith("<!-- end -->\n")
    assert section.strip() in page
