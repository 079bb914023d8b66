# SPDX-License-Identifier: MIT
"""Files of the repository as the rules read them, and the faults that rules report."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath

PACKAGE = "python/drivetwin"


@dataclass(frozen=True)
class Fault:
    """A broken rule at a place."""

    rule: str
    path: PurePosixPath
    line: int
    text: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: [{self.rule}] {self.text}"


@dataclass(frozen=True)
class Source:
    """One file: its path relative to the root, and its content."""

    path: PurePosixPath
    data: bytes

    @cached_property
    def text(self) -> str | None:
        """Content as text; None if it is not UTF-8."""
        try:
            return self.data.decode("utf-8")
        except UnicodeDecodeError:
            return None

    @property
    def lines(self) -> list[str]:
        """Lines of the text; empty for a binary file."""
        return (self.text or "").splitlines()


@dataclass(frozen=True)
class Tree:
    """All files of the repository at `root`, sorted by path."""

    root: Path
    sources: tuple[Source, ...]

    def below(self, folder: str, *suffixes: str) -> Iterator[Source]:
        """Yield files under `folder` ("" is the root) with one of the suffixes (default: all)."""
        for source in self.sources:
            inside = not folder or PurePosixPath(folder) in source.path.parents
            if inside and (not suffixes or source.path.suffix in suffixes):
                yield source


Rule = Callable[[Tree], Iterator[Fault]]
Edges = set[tuple[str, str]]
"""Pairs of the importing and the imported module."""


def find_circles(edges: Edges) -> list[list[str]]:
    """Return the strongly connected sets of more than one node, the largest first."""
    after: dict[str, set[str]] = {}
    for start, end in edges:
        after.setdefault(start, set()).add(end)
    reached: dict[str, set[str]] = {}
    for start in after:
        seen: set[str] = set()
        ahead = [*after[start]]
        while ahead:
            name = ahead.pop()
            if name not in seen:
                seen.add(name)
                ahead += after.get(name, ())
        reached[start] = seen
    circles = {
        frozenset(other for other in reached[name] if name in reached.get(other, ()))
        for name in reached
        if name in reached[name]
    }
    return sorted((sorted(circle) for circle in circles), key=len, reverse=True)


def read_tree(root: Path) -> Tree:
    """Read the tracked files below `root`, and new ones that are not ignored.

    Raises subprocess.CalledProcessError if `root` is in no git repository.
    """
    listing = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=root,
        capture_output=True,
        check=True,
    ).stdout.decode()
    names = sorted({name for name in listing.split("\0") if name})
    return Tree(
        root,
        tuple(
            Source(PurePosixPath(name), (root / name).read_bytes())
            for name in names
            if (root / name).is_file()
        ),
    )
