# SPDX-License-Identifier: MIT
"""Sentences of a page are counted without code, tables and headings."""

from __future__ import annotations

from tools.sentences import find_long, list_pages


def test_the_documents_have_few_long_sentences() -> None:
    found = [find_long(page.read_text(encoding="utf-8")) for page in list_pages()]
    assert sum(len(long) for long, _ in found) < 0.02 * sum(count for _, count in found)
