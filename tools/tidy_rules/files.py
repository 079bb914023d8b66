# SPDX-License-Identifier: MIT
"""Rules on files: sizes (those of functions are checked by ruff and clippy), place of tests."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import PurePosixPath

from tools.tidy_rules.base import Fault, Tree

MAX_FILE_LINES = 500
MAX_FILE_BYTES = 1_000_000
RUST_TESTS = re.compile(r"^#\[cfg\(test\)\]\s*\n\s*mod\s+\w+\s*\{", re.MULTILINE)
WHOLE_PROGRAM = ("tests/system", "tests/browser")
GIVEN_LOGS = "given_logs"
_SOURCE_ROOTS = ("python/drivetwin", ".")


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


def check_tests(tree: Tree) -> Iterator[Fault]:
    """Require a module for every test: `tests/a/test_b.py` tests `python/drivetwin/a/b.py`.

    A second file on one module adds a word (`test_units_property.py`); `test_given_logs.py` runs
    its folder on recordings from outside; tests of several folders stand in `tests/system`, tests
    that need a browser in `tests/browser`.
    """
    modules = {source.path.with_suffix("") for source in tree.below("", ".py", ".sh")}
    packages = {path.parent for path in modules}
    for source in tree.below("tests", ".py"):
        if not source.path.name.startswith("test_"):
            continue
        if any(PurePosixPath(one) in source.path.parents for one in WHOLE_PROGRAM):
            continue
        subject = source.path.stem.removeprefix("test_")
        folder = source.path.parent.relative_to("tests")
        known = {
            path.name
            for root in _SOURCE_ROOTS
            for path in modules | packages
            if path.parent == PurePosixPath(root) / folder
        }
        if known and subject == GIVEN_LOGS:
            continue
        if not any(subject == name or subject.startswith(f"{name}_") for name in known):
            text = f"no module {subject} in {folder} to test; name its subject, or tests/system"
            yield Fault("tests-mirror-sources", source.path, 1, text)
