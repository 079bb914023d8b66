# SPDX-License-Identifier: MIT
"""Rules of the Rust core: no Python, no files, no printing, and one direction of imports."""

from __future__ import annotations

import re
from collections.abc import Iterator

from tools.tidy_rules.base import Fault, Source, Tree

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
