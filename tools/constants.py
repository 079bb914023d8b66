# SPDX-License-Identifier: MIT
"""Count the numeric constants of the product.

`python -m tools.constants [--list] [REVISION]` counts, in the working tree or at a revision,
numeric constants of modules and fields of settings classes with a numeric default, by file, and
numbers in TOML files of settings. A tuple or table counts once. Vehicles, gearboxes, scenarios and
examples are data, and the seconds of stages are measured: they do not count.
"""

from __future__ import annotations

import argparse
import ast
import subprocess
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PRODUCT = "python/drivetwin"
DATA = ("cards", "examples", "powertrains", "scenarios", "stage_seconds.toml")
"""Folders and files of TOML that describe vehicles, gearboxes, runs and models or are measured."""


def find_constants(source: str) -> set[str]:
    """Find the numeric constants and settings fields of a module.

    Parameters
    ----------
    source
        Text of the module.

    Returns
    -------
    set
        Names of constants, and `Class.field` of settings.
    """
    found = set()
    for node in ast.parse(source).body:
        if isinstance(node, ast.ClassDef) and node.name.endswith("Settings"):
            for name, value in _list_assignments(node.body):
                found |= {f"{node.name}.{name}"} if _has_number(value) else set()
        else:
            for name, value in _list_assignments([node]):
                found |= {name} if name.isupper() and _has_number(value) else set()
    return found


def count_toml(text: str) -> int:
    """Count the numbers in a TOML text."""

    def walk(value: Any) -> int:
        if isinstance(value, dict):
            return sum(map(walk, value.values()))
        if isinstance(value, list):
            return sum(map(walk, value))
        return int(isinstance(value, int | float) and not isinstance(value, bool))

    return walk(tomllib.loads(text))


def _list_assignments(nodes: list[ast.stmt]) -> Iterator[tuple[str, ast.expr]]:
    """Yield name and value of the assignments to one name."""
    for node in nodes:
        targets: list[ast.expr]
        if isinstance(node, ast.AnnAssign) and node.value is not None:
            targets, value = [node.target], node.value
        elif isinstance(node, ast.Assign):
            targets, value = node.targets, node.value
        else:
            continue
        for target in targets:
            names = target.elts if isinstance(target, ast.Tuple) else [target]
            values = value.elts if isinstance(value, ast.Tuple) and len(names) > 1 else [value]
            if len(values) != len(names):  # a value for all, or an unpacked one
                values = [value] * len(names)
            for name, one in zip(names, values, strict=True):
                if isinstance(name, ast.Name):
                    yield name.id, one


def _has_number(value: ast.expr) -> bool:
    """Return whether an expression has a numeric literal."""
    return any(
        isinstance(node, ast.Constant)
        and isinstance(node.value, int | float)
        and not isinstance(node.value, bool)
        for node in ast.walk(value)
    )


def count_constants(files: dict[str, str]) -> dict[str, int]:
    """Count the constants of each product file, given the texts by path."""
    counts = {}
    for path, text in files.items():
        if path.endswith(".py"):
            counts[path] = len(find_constants(text))
        elif not set(Path(path).parts) & set(DATA):
            counts[path] = count_toml(text)
    return {path: count for path, count in counts.items() if count}


def read_product(revision: str | None) -> dict[str, str]:
    """Read the Python and TOML files of the product, in the working tree or at a revision."""
    listing = ["ls-files"] if revision is None else ["ls-tree", "-r", "--name-only", revision]
    paths = [
        path for path in _run_git(*listing, PRODUCT).split() if path.endswith((".py", ".toml"))
    ]
    if revision is None:
        return {path: (ROOT / path).read_text(encoding="utf-8") for path in paths}
    return {path: _run_git("show", f"{revision}:{path}") for path in paths}


def _run_git(*arguments: str) -> str:
    """Return the output of a git command in the project."""
    command = ["git", "-C", str(ROOT), *arguments]
    return subprocess.run(command, check=True, capture_output=True, encoding="utf-8").stdout


def main() -> None:
    """Print the count, and with `--list` that of each file."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("revision", nargs="?", help="git revision; without it the working tree")
    parser.add_argument("--list", action="store_true", help="print the count of each file")
    given = parser.parse_args()
    counts = count_constants(read_product(given.revision))
    if given.list:
        for path, count in sorted(counts.items(), key=lambda one: -one[1]):
            print(f"{count:5} {path}")
    print(f"{sum(counts.values())} numbers in constants and settings of {len(counts)} files")


if __name__ == "__main__":
    main()
