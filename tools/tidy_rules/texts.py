# SPDX-License-Identifier: MIT
"""Rules on texts: licence lines, no paths of one machine, documents that name existing files."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import PurePosixPath

from tools.tidy_rules.base import Fault, Source, Tree

SPDX = "SPDX-License-Identifier: MIT"
DOCUMENTS = ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "docs")

_LICENSED = (".py", ".pyi", ".rs", ".sh")
_MACHINE_PATH = re.compile(r"(?<![\w.)}])/(?:work|tmp|root|home)/")
_MAY_NAME_MACHINES = (".ci", "Makefile")
_CODE_SPAN = re.compile(r"`([^`\n]+)`")
_LINK = re.compile(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)")
_FOLDERS = frozenset(
    {".ci", "benchmarks", "crates", "docs", "examples", "python", "reference", "tests", "tools"}
)
_PATH = re.compile(r"[\w.-]+(?:/[\w.-]+)*/?")


def check_licence(tree: Tree) -> Iterator[Fault]:
    """Require the licence in the first line (after `#!`) of every source file with content."""
    for source in tree.below("", *_LICENSED):
        lines = source.lines
        if not lines:
            continue
        first = 1 if lines[:1] and lines[0].startswith("#!") else 0
        if not (lines[first : first + 1] and lines[first].endswith(SPDX)):
            yield Fault("licence-line", source.path, first + 1, f"does not say {SPDX}")


def check_machine_paths(tree: Tree) -> Iterator[Fault]:
    """Reject absolute paths of the machine on which a file was written."""
    for source in tree.sources:
        if source.path.parts[0] in _MAY_NAME_MACHINES:
            continue
        for number, text in enumerate(source.lines, start=1):
            match = _MACHINE_PATH.search(text)
            if match:
                text = f"{match.group()} is a path of one machine"
                yield Fault("machine-path", source.path, number, text)


def _is_path(span: str) -> bool:
    """Return whether a code span names a file in a known folder, or a file of the root."""
    if not _PATH.fullmatch(span):
        return False
    folder, slash, _ = span.partition("/")
    return (bool(slash) and folder in _FOLDERS) or (
        not slash and span.endswith((".md", ".py", ".rs", ".sh"))
    )


def _find_paths(source: Source) -> Iterator[tuple[int, str]]:
    for number, text in enumerate(source.lines, start=1):
        yield from ((number, span) for span in _CODE_SPAN.findall(text) if _is_path(span))
        for link in _LINK.findall(text):
            yield number, (source.path.parent / link).as_posix()


def check_named_paths(tree: Tree) -> Iterator[Fault]:
    """Require that every path named in a document exists."""
    files = {source.path for source in tree.sources}
    known = files.union(*(path.parents for path in files))
    for document in tree.below("", ".md"):
        if document.path.parts[0] not in DOCUMENTS:
            continue
        for line, name in _find_paths(document):
            path = PurePosixPath(_normalize(name))
            if path not in known:
                yield Fault("named-path", document.path, line, f"{name} does not exist")


def _normalize(name: str) -> str:
    """Resolve `..` in a path, as far as it stays in the repository."""
    parts: list[str] = []
    for part in PurePosixPath(name).parts:
        if part == ".." and parts:
            parts.pop()
        else:
            parts.append(part)
    return "/".join(parts)
