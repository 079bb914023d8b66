# SPDX-License-Identifier: MIT
"""No page uses a term of the glossary before a page has defined it."""

from __future__ import annotations

import pytest

from tools.glossary_order import check_documents, find_undefined, list_terms

GLOSSARY = """# Glossary

**Slip.** Difference of speed.

**Lock-up.** End of the *slip*.

**Unit.** One vehicle.
"""


def test_the_documents_define_terms_before_they_use_them() -> None:
    assert check_documents() == []


@pytest.mark.parametrize(
    ("first", "second", "found"),
    [
        ("The slip ends.", "", [("slip", "a.md")]),
        ("The *slip* ends. A slip.", "At lock-up.", [("lock-up", "b.md")]),
        ("At the [lock-up](../glossary.md) the *slip* ends.", "Slips, lock-up.", []),
        ("A slip, or *slip*.", "", [("slip", "a.md")]),
        ("# Slip\n\n`slip` and [slip](other.md)\n\n    slip\n", "The *slip*.", []),
        ("", "", []),
    ],
)
def test_a_use_before_the_definition_is_found(
    first: str, second: str, found: list[tuple[str, str]]
) -> None:
    pages = {"a.md": first, "b.md": second, "glossary.md": "", "c.md": "A slip at lock-up."}
    assert list(find_undefined(pages, list_terms(GLOSSARY))) == found
