# SPDX-License-Identifier: MIT
"""Circles of imports among the files of the Rust core.

`python -m tools.tidy_rules.core_imports` prints every circle with its length.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath

from tools.tidy_rules.base import Fault, Tree, read_tree
from tools.tidy_rules.rust import mask, without_tests

SOURCES = "crates/drivetwin-core/src"
MAX_CIRCLE = 2
"""Files that may import each other."""

_USE = re.compile(r"^(pub(?:\([^)]*\))? )?use ([^;]+);", re.MULTILINE)

Module = tuple[str, ...]
Graph = dict[Module, set[Module]]


def core_circles(tree: Tree) -> Iterator[Fault]:
    """Report circles of imports with more than `MAX_CIRCLE` files."""
    for circle in find_circles(import_graph(tree)):
        if len(circle) > MAX_CIRCLE:
            names = ", ".join("::".join(module) for module in circle)
            path = PurePosixPath(SOURCES)
            yield Fault("core-circles", path, 1, f"{len(circle)} files in a circle: {names}")


def import_graph(tree: Tree) -> Graph:
    """Map each module of the core to the modules whose items it imports.

    An item that a `mod.rs` re-exports counts as an import of the file that defines it.
    """
    code: dict[Module, str] = {}
    for source in tree.below(SOURCES, ".rs"):
        parts = source.path.relative_to(SOURCES).with_suffix("").parts
        module = parts[:-1] if parts[-1] == "mod" else parts
        if module != ("lib",):
            code[module] = mask(without_tests(source.text or ""))
    exports = {
        module: {
            path[-1]: path
            for public, body in _USE.findall(text)
            if public
            for path in expand_use(body, module, code)
        }
        for module, text in code.items()
    }
    graph: Graph = {module: set() for module in code}
    for module, text in code.items():
        for public, body in _USE.findall(text):
            for path in expand_use(body, module, code):
                target = _resolve(path, code, exports)
                if target is not None and target != module and not public:
                    graph[module].add(target)
    return graph


def expand_use(body: str, module: Module, code: Mapping[Module, str]) -> Iterator[Module]:
    """Expand the body of a `use` declaration into absolute paths below the crate."""
    text = re.sub(r"\s+as\s+\w+|\s+", "", body)
    for path in _expand_braces(text):
        parts = tuple(path.split("::"))
        if parts[0] == "crate":
            yield parts[1:]
        elif parts[0] == "super":
            yield (*module[:-1], *parts[1:])
        elif parts[0] == "self":
            yield (*module, *parts[1:])
        elif (*module, parts[0]) in code:
            yield (*module, *parts)


def _expand_braces(text: str) -> Iterator[str]:
    """Expand `a::{b, c::{d}}` into its paths."""
    start = text.find("{")
    if start < 0:
        yield text.removesuffix("::self")
        return
    depth, item = 0, ""
    for character in text[start + 1 : -1] + ",":
        depth += {"{": 1, "}": -1}.get(character, 0)
        if character == "," and depth == 0:
            if item:
                yield from _expand_braces(text[:start] + item)
            item = ""
        else:
            item += character


def _resolve(
    path: Module, code: Mapping[Module, str], exports: Mapping[Module, Mapping[str, Module]]
) -> Module | None:
    """Return the module that defines the item at `path`, None outside the core."""
    for length in range(len(path), 0, -1):
        module = path[:length]
        if module in code:
            item = path[length] if length < len(path) else ""
            exported = exports[module].get(item)
            if exported is not None and exported != path:
                return _resolve(exported, code, exports)
            return module
    return None


def find_circles(graph: Graph) -> list[list[Module]]:
    """Return the strongly connected sets of more than one module, largest first."""
    reached = {module: _reach(module, graph) for module in graph}
    circles: list[list[Module]] = []
    assigned: set[Module] = set()
    for module in sorted(graph):
        if module not in assigned:
            circle = [other for other in sorted(reached[module]) if module in reached[other]]
            assigned.update(circle)
            if len(circle) > 1:
                circles.append(circle)
    return sorted(circles, key=len, reverse=True)


def _reach(module: Module, graph: Graph) -> set[Module]:
    """Return the modules that imports lead to from `module`."""
    reached: set[Module] = set()
    pending = [module]
    while pending:
        for target in graph[pending.pop()]:
            if target not in reached:
                reached.add(target)
                pending.append(target)
    return reached


def _print_circles() -> None:
    """Print the circles of the repository around this file."""
    circles = find_circles(import_graph(read_tree(Path(__file__).resolve().parents[2])))
    for circle in circles:
        print(len(circle), ", ".join("::".join(module) for module in circle))
    if not circles:
        print("no circles")


if __name__ == "__main__":
    _print_circles()
