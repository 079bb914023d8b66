# SPDX-License-Identifier: MIT
"""Licences, versions and hashes of Python packages cover what pyproject.toml asks for."""

from __future__ import annotations

import json
import re

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tools.python_packages import (
    CONSTRAINTS,
    LICENCES,
    SBOM,
    list_requirements,
)


def read_names(text: str) -> set[str]:
    return {match[1] for match in re.finditer(r"^([\w.-]+)(?:==| \d)", text, re.MULTILINE)}


def test_every_requirement_has_its_licence() -> None:
    wanted = {
        canonicalize_name(Requirement(one).name) for one in list_requirements(development=False)
    }
    text = LICENCES.read_text(encoding="utf-8")
    assert wanted <= read_names(text), "write them anew: make notices"
    assert "not stated" not in text


def test_the_versions_of_the_build_machine_are_fixed() -> None:
    text = CONSTRAINTS.read_text(encoding="utf-8")
    wanted = {
        canonicalize_name(Requirement(one).name) for one in list_requirements(development=True)
    }
    assert wanted <= read_names(text), "write them anew: make notices"
    fixed = dict(re.findall(r"^([\w.-]+)==(\S+)", text, re.MULTILINE))
    for one in map(Requirement, list_requirements(development=True)):
        name = canonicalize_name(one.name)
        assert one.specifier.contains(fixed[name], prereleases=True), one


def test_each_fixed_version_has_hashes() -> None:
    """A version without one would be refused, and an address would bind CI to one index."""
    text = CONSTRAINTS.read_text(encoding="utf-8")
    for entry in re.split(r"\n(?=\S)", re.sub(r"^#.*\n", "", text, flags=re.MULTILINE)):
        assert re.search(r"--hash=sha256:[0-9a-f]{64}\b", entry), entry
    assert "://" not in text


def test_the_list_of_parts_is_that_of_the_licences() -> None:
    parts = json.loads(SBOM.read_text(encoding="utf-8"))["components"]
    text = LICENCES.read_text(encoding="utf-8")
    lines = {f"{one['name']} {one['version']}" for one in parts}
    assert lines == set(re.findall(r"^(\S+ \S+): ", text, re.MULTILINE)), "make notices"
    scopes = {one["name"]: one["scope"] for one in parts}
    assert (scopes["numpy"], scopes["typing-extensions"]) == ("required", "required")
    assert scopes["asammdf"] == "optional"
