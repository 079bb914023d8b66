# SPDX-License-Identifier: MIT
"""Licences and versions of Python packages cover what pyproject.toml asks for."""

from __future__ import annotations

import re

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tools.python_packages import (
    CONSTRAINTS,
    LICENCES,
    Package,
    find_packages,
    format_constraints,
    format_licences,
    list_requirements,
)

ASKED = ["pydantic>=2", "absent-package", "rich; python_version < '3'"]


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
    documentation = {"sphinx", "myst-parser", "furo"}
    wanted = {
        canonicalize_name(Requirement(one).name) for one in list_requirements(development=True)
    }
    assert wanted - documentation <= read_names(text), "write them anew: make notices"
    fixed = dict(re.findall(r"^([\w.-]+)==(\S+)$", text, re.MULTILINE))
    for one in map(Requirement, list_requirements(development=True)):
        name = canonicalize_name(one.name)
        assert name not in fixed or one.specifier.contains(fixed[name], prereleases=True), one


def test_needed_packages_are_followed() -> None:
    found = {one.name: one for one in find_packages(ASKED)}
    assert {"pydantic", "pydantic-core", "typing-extensions"} <= set(found)
    assert found["pydantic"].licence == "MIT"
    assert "rich" not in found


def test_formats() -> None:
    packages = (Package("a", "1.0", "MIT"), Package("b", "2", "BSD"))
    assert format_licences(packages).endswith("a 1.0: MIT\nb 2: BSD\n")
    assert format_constraints(packages).endswith("a==1.0\nb==2\n")
