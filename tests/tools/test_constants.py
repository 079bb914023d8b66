# SPDX-License-Identifier: MIT
"""Numeric constants and settings are counted, data and names are not."""

from __future__ import annotations

from tools.constants import count_constants, find_constants

SOURCE = """
LIMIT = 3.0
LEFT, RIGHT = (1, 2), "text"
FIRST, SECOND = (*("a", "b"),)
NAME = "a"
RATE: float = 2 * 5
lower = 4.0

class SearchSettings:
    steps: int = 3
    verbose: bool = True
    label: str = ""

class Search:
    steps: int = 3
"""


def test_constants_and_settings_fields_are_found() -> None:
    assert find_constants(SOURCE) == {"LIMIT", "LEFT", "RATE", "SearchSettings.steps"}


def test_data_files_do_not_count() -> None:
    text = "a = 1.0\nb = [2, 3]\nc = true\nd = 'x'\n"
    files = {"p/settings.toml": text, "p/cards/x.toml": text, "p/a.py": "A = 1\n", "p/b.py": ""}
    assert count_constants(files) == {"p/settings.toml": 3, "p/a.py": 1}
