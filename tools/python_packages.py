# SPDX-License-Identifier: MIT
"""Write licences, versions and hashes of the Python packages that the project uses.

`python -m tools.python_packages` writes PYTHON-LICENCES.txt and python-packages.cyclonedx.json with
the packages that users install, and constraints.txt with the versions of the build machine and the
hashes of their files. It reads the metadata of the installed packages and asks the package index
for hashes; call it in the development environment after a change of pyproject.toml or an update.
"""

from __future__ import annotations

import platform
import re
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from itertools import chain
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tools.sbom import Part, format_sbom

ROOT = Path(__file__).resolve().parents[1]
LICENCES = ROOT / "PYTHON-LICENCES.txt"
CONSTRAINTS = ROOT / "constraints.txt"
SBOM = ROOT / "python-packages.cyclonedx.json"
_HEAD = """\
Python packages that drivetwin installs, its extras included, with those that they need. None of
them is part of the wheel. Written by `python -m tools.python_packages`.

"""
_PINS = """\
# Versions and hashes of the files with which the build machine installs, for all platforms.
# Written by `python -m tools.python_packages`.
"""
_LONGEST = 80
"""Length of a licence field that is a name; longer ones are texts."""


@dataclass(frozen=True)
class Package:
    """An installed package; `needs` are the names of the packages that it requires."""

    name: str
    version: str
    licence: str
    needs: frozenset[str] = frozenset()


def find_packages(requirements: Iterable[str]) -> tuple[Package, ...]:
    """Return the installed packages that the requirements lead to, by name.

    Packages for other systems or Python versions are left out; so are those that are absent.
    """
    found: dict[str, Distribution] = {}
    needs: dict[str, set[str]] = {}
    waiting = [(Requirement(one), "", "") for one in requirements]
    done: set[tuple[str, str]] = set()
    while waiting:
        wanted, extra, parent = waiting.pop()
        name = canonicalize_name(wanted.name)
        if wanted.marker is not None and not wanted.marker.evaluate({"extra": extra}):
            continue
        try:
            one = distribution(wanted.name)
        except PackageNotFoundError:
            continue
        found[name] = one
        needs.setdefault(parent, set()).add(name)
        for own in ("", *wanted.extras):
            if (name, own) not in done:
                done.add((name, own))
                waiting += [(Requirement(text), own, name) for text in one.requires or ()]
    return tuple(
        Package(name, one.version, read_licence(one), frozenset(needs.get(name, ())))
        for name, one in sorted(found.items())
    )


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
    document = _read_project()
    project = document["project"]
    texts = [*project["dependencies"], *chain(*project["optional-dependencies"].values())]
    if development:
        for group in document["dependency-groups"].values():
            texts += [entry for entry in group if isinstance(entry, str)]
    return [text for text in texts if not re.match(r"drivetwin\b", text)]


def _read_project() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def format_licences(packages: Iterable[Package]) -> str:
    """Return the table of licences."""
    return _HEAD + "".join(f"{one.name} {one.version}: {one.licence}\n" for one in packages)


def format_python_sbom(packages: Sequence[Package]) -> str:
    """Return the CycloneDX list of the packages that users install, by extras if optional."""
    always = {one.name for one in find_packages(_read_project()["project"]["dependencies"])}
    asked = list_requirements(development=False)
    direct = {canonicalize_name(Requirement(text).name) for text in asked}
    urls = {one.name: f"pkg:pypi/{one.name}@{one.version}" for one in packages}

    def build(one: Package) -> Part:
        needs = frozenset(urls[name] for name in one.needs if name in urls)
        return Part("pypi", one.name, one.version, one.licence, needs, one.name not in always)

    needs = frozenset(url for name, url in urls.items() if name in direct)
    root = Part("pypi", "drivetwin", read_version(), "MIT", needs)
    return format_sbom(root, [build(one) for one in packages])


def read_version() -> str:
    """Return the version of the project, which the crates share."""
    document = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))
    return str(document["workspace"]["package"]["version"])


def lock_packages(packages: Iterable[Package], path: Path) -> None:
    """Write the versions of `packages` to `path`, with the hashes of all their files.

    Packages that other platforms need are resolved to versions that fit. Raises
    subprocess.CalledProcessError if there is no solution or no package index.
    """
    groups = [f"--group={name}" for name in _read_project()["dependency-groups"]]
    kind = ("--universal", "--python-version", platform.python_version(), "--generate-hashes")
    style = ("--no-header", "--no-annotate", "--quiet")
    with tempfile.TemporaryDirectory() as folder:
        pins = Path(folder) / "pins.txt"
        pins.write_text("".join(f"{one.name}=={one.version}\n" for one in packages), "utf-8")
        command = [sys.executable, "-m", "uv", "pip", "compile", *kind, *style, "--all-extras"]
        files = ("--constraints", str(pins), "--output-file", str(path), "pyproject.toml")
        subprocess.run([*command, *groups, *files], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    path.write_text(_PINS + path.read_text(encoding="utf-8"), encoding="utf-8", newline="\n")


def main() -> int:
    """Write all files."""
    used = find_packages(list_requirements(development=False))
    LICENCES.write_text(format_licences(used), encoding="utf-8", newline="\n")
    SBOM.write_text(format_python_sbom(used), encoding="utf-8", newline="\n")
    lock_packages(find_packages(list_requirements(development=True)), CONSTRAINTS)
    return 0


if __name__ == "__main__":
    sys.exit(main())
