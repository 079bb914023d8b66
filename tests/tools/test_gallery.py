# SPDX-License-Identifier: MIT
"""The gallery is that of its entries, and each picture exists."""

from __future__ import annotations

from tools.gallery import ENTRIES, PAGE, write_page
from tools.picture import PICTURES


def test_the_page_is_up_to_date() -> None:
    assert PAGE.read_text(encoding="utf-8") == write_page()


def test_each_entry_has_its_picture() -> None:
    pictures = {path.name for path in PICTURES.glob("gallery-*.png")}
    assert pictures == {f"gallery-{entry.name}.png" for entry in ENTRIES}
