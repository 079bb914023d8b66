# SPDX-License-Identifier: MIT
"""Write the licences and the list of the crates that are linked into the native module.

`python -m tools.notices` writes THIRD-PARTY-NOTICES.txt, which every wheel carries beside LICENSE,
and rust-crates.cyclonedx.json, its list of crates; call it after a change of Cargo.lock. It needs
cargo and the sources of the crates.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tools.sbom import Part, format_sbom

ROOT = Path(__file__).resolve().parents[1]
NOTICES = ROOT / "THIRD-PARTY-NOTICES.txt"
SBOM = ROOT / "rust-crates.cyclonedx.json"
MODULE = "drivetwin-py"

_HEAD = """\
The native module of drivetwin contains the Rust crates below and the Rust standard library
(MIT OR Apache-2.0, The Rust Project Contributors). Where a crate leaves the choice, its MIT licence
is taken. Written by `python -m tools.notices`.
"""
_RULE = "-" * 79
_NAMES = ("LICENSE", "LICENCE", "COPYING", "NOTICE")
_WITHOUT_TEXT = "Licensed under {licence} by {authors}; the crate ships no text of its own."


@dataclass(frozen=True)
class Crate:
    """A linked crate: name, version, and the texts that its licence wants to be passed on."""

    name: str
    version: str
    texts: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.name} {self.version}"


@dataclass(frozen=True)
class Linked:
    """Metadata of the linked crates by cargo: packages, and their dependencies, by id."""

    packages: dict[str, dict[str, Any]]
    needs: dict[str, list[str]]


def find_linked() -> Linked:
    """Return the crates that a build for any platform links, the project's own among them.

    Raises subprocess.CalledProcessError if cargo cannot resolve them.
    """
    command = ["cargo", "metadata", "--locked", "--format-version", "1"]
    metadata = json.loads(
        subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout
    )
    packages = {package["id"]: package for package in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    needs: dict[str, list[str]] = {}
    waiting = [id for id, package in packages.items() if package["name"] == MODULE]
    while waiting:
        id = waiting.pop()
        if id in needs or _is_procedural_macro(packages[id]):
            continue
        needs[id] = [each["pkg"] for each in nodes[id]["deps"] if _is_linked(each)]
        waiting += needs[id]
    return Linked({id: packages[id] for id in needs}, needs)


def find_crates(linked: Linked) -> tuple[Crate, ...]:
    """Return the linked crates of others with their texts, by name."""
    foreign = (one for one in linked.packages.values() if one["source"] is not None)
    return tuple(sorted(map(_read_crate, foreign), key=str))


def format_crate_sbom(linked: Linked) -> str:
    """Return the CycloneDX list of the linked crates."""
    plain = {
        id: Part("cargo", one["name"], one["version"], one["license"])
        for id, one in linked.packages.items()
    }
    parts = (
        replace(
            part, needs=frozenset(plain[each].url for each in linked.needs[id] if each in plain)
        )
        for id, part in plain.items()
    )
    ordered = sorted(parts, key=lambda part: part.url)
    (root,) = (part for part in ordered if part.name == MODULE)
    return format_sbom(root, [part for part in ordered if part is not root])


def _is_procedural_macro(package: dict[str, Any]) -> bool:
    return any("proc-macro" in target["kind"] for target in package["targets"])


def _is_linked(dependency: dict[str, Any]) -> bool:
    """Return whether a dependency is linked: not one of build scripts or tests only."""
    return any(kind["kind"] is None for kind in dependency["dep_kinds"])


def _read_crate(package: dict[str, Any]) -> Crate:
    texts = tuple(_read_texts(Path(package["manifest_path"]).parent))
    if not texts:
        by = ", ".join(package["authors"]) or package["repository"]
        texts = (_WITHOUT_TEXT.format(licence=package["license"], authors=by),)
    return Crate(package["name"], package["version"], texts)


def _read_texts(folder: Path) -> Iterator[str]:
    """Yield the MIT licence of a crate, or else all licences, and those of its C sources."""
    own = sorted(path for path in folder.iterdir() if path.name.upper().startswith(_NAMES))
    mit = [path for path in own if "MIT" in path.name.upper()]
    for path in (*(mit or own), *sorted(folder.glob("c_src/**/LICENSE"))):
        lines = path.read_text(encoding="utf-8").strip().splitlines()
        yield "\n".join(line.rstrip() for line in lines)


def format_notices(crates: tuple[Crate, ...]) -> str:
    """Return the notices as text: each licence once, below the crates that it belongs to."""
    owners: dict[tuple[str, ...], list[str]] = {}
    for crate in crates:
        owners.setdefault(tuple(dict.fromkeys(crate.texts)), []).append(str(crate))
    parts = [_HEAD]
    for texts, names in owners.items():
        parts.append("\n\n".join([_RULE, "\n".join(names), *texts]) + "\n")
    return "\n".join(parts)


def main() -> int:
    """Write both files."""
    linked = find_linked()
    NOTICES.write_text(format_notices(find_crates(linked)), encoding="utf-8", newline="\n")
    SBOM.write_text(format_crate_sbom(linked), encoding="utf-8", newline="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
