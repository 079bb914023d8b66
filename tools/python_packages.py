# SPDX-License-Identifier: MIT
"""Write the licences and the versions of the Python packages that the project uses.

`python -m tools.python_packages` writes PYTHON-LICENCES.txt, with the packages that users install,
and constraints.txt, the versions with which the build machine installs everything. It reads the
metadata of the installed packages; call it in the development environment after a change of
pyproject.toml or an update.
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from itertools import chain
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
LICENCES = ROOT / "PYTHON-LICENCES.txt"
CONSTRAINTS = ROOT / "constraints.txt"
_HEAD = """\
Python packages that drivetwin installs, its extras included, with those that they need. None of
them is part of the wheel. Written by `python -m tools.python_packages`.

"""
_PINS = """\
# Versions with which the build machine installs. Written by `python -m tools.python_packages`.
"""
_LONGEST = 80
"""Length of a licence field that is a name; longer ones are texts."""


@dataclass(frozen=True)
class Package:
    """An installed package."""

    name: str
    version: str
    licence: str


def find_packages(requirements: Iterable[str]) -> tuple[Package, ...]:
    """Return the installed packages that the requirements lead to, by name.

    Packages for other systems or Python versions are left out; so are those that are absent.
    """
    found: dict[str, Package] = {}
    waiting = [(Requirement(one), "") for one in requirements]
    done: set[tuple[str, str]] = set()
    while waiting:
        wanted, extra = waiting.pop()
        name = canonicalize_name(wanted.name)
        if wanted.marker is not None and not wanted.marker.evaluate({"extra": extra}):
            continue
        try:
            one = distribution(wanted.name)
        except PackageNotFoundError:
            continue
        found[name] = Package(name, one.version, read_licence(one))
        for own in ("", *wanted.extras):
            if (name, own) not in done:
                done.add((name, own))
                waiting += [(Requirement(text), own) for text in one.requires or ()]
    return tuple(found[name] for name in sorted(found))


def read_licence(one: Distribution) -> str:
    """Return the licence that a package states: its expression, its field, or its classifiers."""
    fields = one.metadata.json
    if expression := fields.get("license_expression"):
        return str(expression)
    stated = str(fields.get("license") or "").strip()
    if stated and "\n" not in stated and len(stated) <= _LONGEST and stated != "UNKNOWN":
        return stated
    names = [
        text.rsplit(" :: ", 1)[1]
        for text in fields.get("classifier", ())
        if text.startswith("License ::")
    ]
    return " AND ".join(names) or "not stated"


def list_requirements(*, development: bool) -> list[str]:
    """Return the requirements of the project with its extras, and of `development` if asked for."""
    document: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    project = document["project"]
    texts = [*project["dependencies"], *chain(*project["optional-dependencies"].values())]
    if development:
        for group in document["dependency-groups"].values():
            texts += [entry for entry in group if isinstance(entry, str)]
    return [text for text in texts if not re.match(r"drivetwin\b", text)]


def format_licences(packages: Iterable[Package]) -> str:
    """Return the table of licences."""
    return _HEAD + "".join(f"{one.name} {one.version}: {one.licence}\n" for one in packages)


def format_constraints(packages: Iterable[Package]) -> str:
    """Return the versions in the form of pip's constraints."""
    return _PINS + "".join(f"{one.name}=={one.version}\n" for one in packages)


def main() -> int:
    """Write both files."""
    used = find_packages(list_requirements(development=False))
    LICENCES.write_text(format_licences(used), encoding="utf-8", newline="\n")
    every = find_packages(list_requirements(development=True))
    CONSTRAINTS.write_text(format_constraints(every), encoding="utf-8", newline="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
