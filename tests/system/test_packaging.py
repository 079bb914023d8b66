# SPDX-License-Identifier: MIT
"""What pyproject.toml states twice is stated alike."""

from __future__ import annotations

import tomllib
from pathlib import Path

PROJECT = tomllib.loads((Path(__file__).resolve().parents[2] / "pyproject.toml").read_text("utf-8"))
EXTRAS = PROJECT["project"]["optional-dependencies"]


def test_the_group_of_the_extras_has_what_they_bring() -> None:
    brought = {each for extra, needs in EXTRAS.items() if extra != "all" for each in needs}
    assert PROJECT["dependency-groups"]["extras"] == sorted(brought)


def test_all_is_every_extra() -> None:
    assert EXTRAS["all"] == [f"drivetwin[{','.join(extra for extra in EXTRAS if extra != 'all')}]"]


def test_no_group_is_called_dev() -> None:
    """`maturin develop` installs a group of that name, so that a demo would take all tools."""
    assert "dev" not in PROJECT["dependency-groups"]
