# SPDX-License-Identifier: MIT
"""Gallery and notebook are up to date, and each picture exists and is small."""

from __future__ import annotations

from tools.gallery import ENTRIES, NOTEBOOK, PAGE, SHOTS, TUTORIALS, write_notebook, write_page
from tools.picture import PICTURES

LARGEST = 150_000
"""Size of a picture of a tutorial that loads at once [bytes]."""


def test_the_page_is_up_to_date() -> None:
    assert PAGE.read_text(encoding="utf-8") == write_page()


def test_each_entry_has_its_picture() -> None:
    pictures = {path.name for path in PICTURES.glob("gallery-*.png")}
    assert pictures == {f"gallery-{entry.name}.png" for entry in ENTRIES}


def test_each_tutorial_shows_its_pictures() -> None:
    assert {page.stem for page in TUTORIALS.glob("*.md")} == set(SHOTS)
    for name, shots in SHOTS.items():
        page = (TUTORIALS / f"{name}.md").read_text(encoding="utf-8")
        for picture in (PICTURES / f"tutorial-{one}.png" for one in shots):
            assert f"(../img/{picture.name})" in page
            assert picture.stat().st_size < LARGEST, picture.name


def test_the_notebook_is_that_of_its_page() -> None:
    page = (TUTORIALS / "notebook.md").read_text(encoding="utf-8")
    assert NOTEBOOK.read_text(encoding="utf-8") == write_notebook(page)
