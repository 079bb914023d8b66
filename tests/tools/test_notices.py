# SPDX-License-Identifier: MIT
"""The notices that wheels carry name the crates of Cargo.lock, with their licences."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

from tools.notices import NOTICES, SBOM

ROOT = Path(__file__).resolve().parents[2]


def toml(name: str) -> dict[str, Any]:
    return tomllib.loads((ROOT / name).read_text(encoding="utf-8"))


def named() -> set[tuple[str, str]]:
    """Name and version of every crate in the notices."""
    parts = NOTICES.read_text(encoding="utf-8").split("-" * 79 + "\n")[1:]
    heads = "\n".join(part.strip().split("\n\n")[0] for part in parts)
    return set(re.findall(r"^([\w-]+) (\d\S*)$", heads, re.MULTILINE))


def test_the_notices_are_those_of_the_locked_crates() -> None:
    locked = {(each["name"], each["version"]) for each in toml("Cargo.lock")["package"]}
    assert named() - locked == set(), "write them anew: python -m tools.notices"


def test_what_the_project_asks_for_is_named() -> None:
    wanted: set[str] = set()
    for crate in ("drivetwin-core", "drivetwin-py"):
        wanted |= set(toml(f"crates/{crate}/Cargo.toml")["dependencies"])
    assert wanted - {"drivetwin-core", "drivetwin-table"} <= {name for name, _ in named()}


def test_the_list_of_crates_is_that_of_the_notices() -> None:
    parts = json.loads(SBOM.read_text(encoding="utf-8"))["components"]
    listed = {(one["name"], one["version"]) for one in parts}
    own = {name for name, _ in listed - named()}
    assert own == {"drivetwin-core", "drivetwin-table"}
    assert named() <= listed, "write them anew: make notices"


def test_wheels_carry_them() -> None:
    assert NOTICES.name in toml("pyproject.toml")["project"]["license-files"]
    assert SBOM.name in toml("pyproject.toml")["tool"]["maturin"]["sbom"]["include"]
