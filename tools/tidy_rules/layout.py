# SPDX-License-Identifier: MIT
"""Rule on the place of tests: the path of a test names the module that it tests."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import PurePosixPath

from tools.tidy_rules.base import Fault, Tree

WHOLE_PROGRAM = ("tests/system", "tests/browser")
GIVEN_LOGS = "given_logs"
_SOURCE_ROOTS = ("python/drivetwin", ".")


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
