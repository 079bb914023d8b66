# SPDX-License-Identifier: MIT
"""Circles of imports in the Python package; lazy and type-only imports count.

The direction of imports between packages is checked by import-linter (`pyproject.toml`).
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from pathlib import PurePosixPath

from tools.tidy_rules import core
from tools.tidy_rules.base import PACKAGE, Edges, Fault, Tree, find_circles

MAX_CIRCLE = 7
"""Largest set of modules that may import each other; all of them stand in one folder."""


def _is_facade(module: ast.Module) -> bool:
    """Return whether an `__init__` file only re-exports names, as to its statements."""
    return not any(isinstance(node, ast.FunctionDef | ast.ClassDef) for node in module.body)


def _find_imports(module: ast.Module) -> Iterator[str]:
    """Yield the full name of every module or symbol imported from the package, at any depth."""
    for node in ast.walk(module):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("drivetwin"):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.startswith("drivetwin."))


def read_edges(tree: Tree) -> Edges:
    """Return pairs (importing module, imported module), without `__init__` files as facades."""
    modules = {}
    for source in tree.below(PACKAGE, ".py"):
        parsed = ast.parse(source.data)
        parts = source.path.relative_to("python").with_suffix("").parts
        if parts[-1] != "__init__":
            modules[".".join(parts)] = parsed
        elif not _is_facade(parsed):
            modules[".".join(parts[:-1])] = parsed
    edges = set()
    for importer, parsed in modules.items():
        for name in _find_imports(parsed):
            imported = name if name in modules else name.rpartition(".")[0]
            if imported in modules and imported != importer:
                edges.add((importer, imported))
    return edges


def _find_folder_imports(edges: Edges) -> Edges:
    """Return the imports between the folders in which modules stand, and between their parents.

    Folders are compared where their paths divide: `a.b.c` -> `a.d.e` makes `a.b` import `a.d`.
    """
    pairs = set()
    for importer, imported in edges:
        above, below = importer.split("."), imported.split(".")
        depth = next(
            (k for k, (a, b) in enumerate(zip(above, below, strict=False)) if a != b), None
        )
        if depth is not None and len(above) > depth + 1 and len(below) > depth + 1:
            pairs.add((".".join(above[: depth + 1]), ".".join(below[: depth + 1])))
    return pairs


def check_circles(tree: Tree) -> Iterator[Fault]:
    """Reject circles of packages, and of modules that are many or stand in several folders."""
    edges = read_edges(tree)
    for packages in find_circles(_find_folder_imports(edges)):
        yield _make_fault(packages, "packages import each other")
    for modules in find_circles(edges):
        folders = {name.rpartition(".")[0] for name in modules}
        if len(modules) > MAX_CIRCLE or len(folders) > 1:
            text = f"{len(modules)} modules of {len(folders)} folders import each other"
            yield _make_fault(modules, text)


def _make_fault(circle: Iterable[str], text: str) -> Fault:
    names = sorted(circle)
    place = PurePosixPath("python", *names[0].split("."))
    return Fault("import-circle", place, 1, f"{text}: {', '.join(names)}")


def describe_circles(tree: Tree) -> str:
    """Return the sizes of the largest circles of modules, and the number of those of packages."""
    edges = read_edges(tree)
    python, rust = (
        max((len(one) for one in find_circles(each)), default=1)
        for each in (edges, core.read_edges(tree))
    )
    packages = len(find_circles(_find_folder_imports(edges)))
    return (
        f"largest circle of modules {python}, circles of packages {packages}, "
        f"largest circle of files in the core {rust}"
    )
