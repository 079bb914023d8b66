# SPDX-License-Identifier: MIT
"""Sizes of files; those of functions are checked by ruff and clippy."""

from __future__ import annotations

import re
from collections.abc import Iterator

from tools.tidy_rules.base import Fault, Tree

MAX_FILE_LINES = 500
MAX_FILE_BYTES = 1_000_000
RUST_TESTS = re.compile(r"^#\[cfg\(test\)\]\s*\n\s*mod\s+\w+\s*\{", re.MULTILINE)


def check_lines(tree: Tree) -> Iterator[Fault]:
    """Reject long source files; the unit tests at the end of a Rust file do not count."""
    for source in tree.below("", ".py", ".pyi", ".rs"):
        text = source.text or ""
        if source.path.suffix == ".rs":
            text = RUST_TESTS.split(text)[0]
        count = len(text.splitlines())
        if count > MAX_FILE_LINES:
            yield Fault("file-lines", source.path, 1, f"{count} lines, at most {MAX_FILE_LINES}")


def check_bytes(tree: Tree) -> Iterator[Fault]:
    """Reject large files of any kind."""
    for source in tree.sources:
        if len(source.data) > MAX_FILE_BYTES:
            text = f"{len(source.data)} bytes, at most {MAX_FILE_BYTES}"
            yield Fault("file-bytes", source.path, 1, text)
