# SPDX-License-Identifier: MIT
"""The page of findings is that of the catalogue, and each answer exists."""

from __future__ import annotations

import re

from drivetwin.findings import Code
from tools.findings_page import PAGE, ROOT, make_anchor, write_page


def test_the_page_is_up_to_date() -> None:
    assert PAGE.read_text(encoding="utf-8") == write_page()


def test_every_code_leads_to_a_question() -> None:
    questions = (ROOT / "docs" / "questions.md").read_text(encoding="utf-8")
    titles = re.findall(r"^## (.+)$", questions, re.MULTILINE)
    rows = re.findall(r"^\| `(\w+)`.*questions\.md#([^)]+)\) \|$", write_page(), re.MULTILINE)
    assert {code for code, _ in rows} == {code.value for code in Code}
    assert {anchor for _, anchor in rows} <= {make_anchor(title) for title in titles}
