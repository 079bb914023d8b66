# SPDX-License-Identifier: MIT
"""Rules of the Rust core: no Python, no files, no printing, and one direction of imports."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import PurePosixPath

from tools.tidy_rules.base import Edges, Fault, Source, Tree, find_circles
from tools.tidy_rules.files import RUST_TESTS

CORE = "crates/drivetwin-core"

_BLANKED = re.compile(
    r"""
    //[^\n]*                                   # line comment
    | r(?P<hash>\#*)".*?"(?P=hash)             # raw string
    | "(?:\\.|[^"\\])*"                        # string
    | '(?:\\(?:u\{[0-9a-fA-F]+\}|x..|.)|[^\\'])'  # character; a lifetime has no closing quote
    | /\*.*?\*/                                # block comment
    """,
    re.VERBOSE | re.DOTALL,
)
_IMPURE = re.compile(
    r"\bpyo3\b|\bstd\s*::\s*(?:fs|io|net|process|env)\b|\b(?:e?print(?:ln)?|dbg)\s*!"
)
_FORBIDDEN = {
    "model": ("network", "solver", "simulate"),
    "network": ("solver", "simulate"),
    "solver": ("model", "simulate"),
}
"""Folders of the core and those they must not import; the solver is independent of elements."""
_USE = re.compile(r"^[ \t]*(pub(?:\([^)]*\))?\s+)?use\s+([^;]+);", re.MULTILINE)
_PATH = re.compile(r"(?<![\w:])((?:crate|super|self)(?:::\w+)+)")
MAX_CIRCLE = 2
"""Largest set of files of the core that may import each other."""


def mask(code: str) -> str:
    """Replace comments and literals of Rust code by spaces; length and lines stay the same."""
    return _BLANKED.sub(lambda match: re.sub(r"[^\n]", " ", match.group()), code)


def _find(source: Source, pattern: re.Pattern[str]) -> Iterator[tuple[int, re.Match[str]]]:
    """Yield line number and match of a pattern in the code, without comments and literals."""
    code = mask(source.text or "")
    for match in pattern.finditer(code):
        yield code.count("\n", 0, match.start()) + 1, match


def check_purity(tree: Tree) -> Iterator[Fault]:
    """Reject Python, files and printing in the core."""
    for source in tree.below(f"{CORE}/src", ".rs"):
        for line, match in _find(source, _IMPURE):
            yield Fault("core-is-pure", source.path, line, f"{match.group()} in the core")
    for source in tree.below(CORE, ".toml"):
        for number, text in enumerate(source.lines, start=1):
            if re.match(r"\s*(?:pyo3|numpy)\b", text):
                yield Fault("core-is-pure", source.path, number, "the core depends on Python")


def check_layers(tree: Tree) -> Iterator[Fault]:
    """Reject imports against the direction model -> network -> solver -> simulate."""
    for folder, forbidden in _FORBIDDEN.items():
        use = re.compile(rf"\bcrate\s*::\s*(?:\{{[^}}]*\b)?({'|'.join(forbidden)})\b")
        for source in tree.below(f"{CORE}/src/{folder}", ".rs"):
            for line, match in _find(source, use):
                text = f"{folder}/ may not use {match.group(1)}/"
                yield Fault("core-layers", source.path, line, text)


def _split_tree(text: str) -> Iterator[str]:
    """Yield the paths of a `use` tree: `a::{b, c::{d}}` gives `a::b` and `a::c::d`."""
    depth, start = 0, 0
    for index, character in enumerate(text + ","):
        depth += (character == "{") - (character == "}")
        if character == "," and depth == 0:
            part = text[start:index].strip()
            start = index + 1
            head, brace, inner = part.partition("{")
            if brace:
                yield from (f"{head}{path}" for path in _split_tree(inner[:-1]))
            elif part:
                yield part.partition(" as ")[0].strip().removesuffix("::self")


def _resolve(path: str, module: tuple[str, ...]) -> tuple[str, ...]:
    """Return a path from the root of the crate, for a use in `module`."""
    parts = path.split("::")
    if parts[0] == "crate":
        return tuple(parts[1:])
    base = module
    while parts and parts[0] in ("super", "self"):
        base = base[:-1] if parts.pop(0) == "super" else base
    return (*base, *parts)


def read_edges(tree: Tree) -> Edges:
    """Return pairs of files (importing, imported); `mod.rs` files that re-export are followed."""
    root = PurePosixPath(CORE, "src")
    codes, exports = {}, {}
    for source in tree.below(str(root), ".rs"):
        parts = source.path.relative_to(root).with_suffix("").parts
        module = parts[:-1] if parts[-1] in ("mod", "lib") else parts
        code = RUST_TESTS.split(mask(source.text or ""))[0]
        codes[module] = code
        for is_public, uses in _USE.findall(code):
            for path in _split_tree(" ".join(uses.split())) if is_public else ():
                anchored = path if path.startswith(("crate::", "super::")) else f"self::{path}"
                exports[*module, path.rpartition("::")[2]] = _resolve(anchored, module)
    edges = set()
    facades = {key[:-1] for key in exports} | {()}
    for module, code in codes.items():
        paths = [
            path for _, uses in _USE.findall(code) for path in _split_tree(" ".join(uses.split()))
        ]
        for path in (*paths, *_PATH.findall(code)):
            if not path.startswith(("crate::", "super::", "self::")):
                continue
            target = _resolve(path, module)
            for _ in range(3):
                target = exports.get(target, target)
            while target and target not in codes:
                target = target[:-1]
            if target != module and target not in facades and module not in facades:
                edges.add(("::".join(module), "::".join(target)))
    return edges


def check_circles(tree: Tree) -> Iterator[Fault]:
    """Reject circles of many files of the core."""
    for circle in find_circles(read_edges(tree)):
        if len(circle) > MAX_CIRCLE:
            text = f"{len(circle)} files import each other: {', '.join(circle)}"
            yield Fault("core-circle", PurePosixPath(CORE, "src"), 1, text)
