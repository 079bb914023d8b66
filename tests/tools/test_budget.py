# SPDX-License-Identifier: MIT
"""The budget counts what LESS can mean, and `make tidy` rejects growth."""

from __future__ import annotations

import ast
from pathlib import Path, PurePosixPath

import pytest

from tools.budget import (
    FILE,
    check_budget,
    compare,
    count_literals,
    count_statements,
    measure,
)
from tools.tidy_rules.base import Source, Tree

MODULE = '''"""Text."""
LIMIT = 3.0
"""Meaning of the limit."""


def add(first):
    """Add."""
    return first + 2.5 - 1
'''


def test_docstrings_and_merged_lines_do_not_count() -> None:
    assert count_statements(ast.parse(MODULE)) == 4
    assert count_statements(ast.parse("a = 1; b = 2\nif a: b = 3")) == 4


def test_literals_of_functions_are_constants() -> None:
    assert count_literals(ast.parse(MODULE)) == 1
    assert count_literals(ast.parse("def f():\n    return -1 + 2 * (lambda: 7.0)()")) == 1


def test_internal_names_are_counted_however_they_are_reached() -> None:
    files = {
        "python/drivetwin/__init__.py": '_HOME = {\n    "run": ("a", "run"),\n}\n',
        "python/drivetwin/a.py": "def run(): ...\ndef inner(): ...\n",
        "tests/help.py": "from drivetwin.a import inner, run\n",
        "tests/test_1.py": "import drivetwin.a as m\nm.inner\nm.run\n",
        "tests/test_2.py": "from tests.help import inner as other\n",
        "tests/test_3.py": "import_module('drivetwin.a')\npatch.setattr('drivetwin.a.inner', 1)\n",
        "tests/test_4.py": "from drivetwin import a, run\na.inner\n",
        "docs/reference/python.md": ".. automodule:: drivetwin\n   :members:\n",
    }
    numbers = measure(_make_tree(files))
    assert numbers["whole.internal_pairs_in_tests"] == 6
    assert numbers["whole.internal_names_in_tests"] == 2


@pytest.mark.parametrize(
    ("number", "bar", "before", "reasons", "faults"),
    [
        (5, 5, 5, {}, 0),
        (4, 5, 5, {}, 0),
        (6, 5, 5, {}, 1),
        (6, 6, 5, {}, 1),
        (6, 6, 5, {"statements.a": "a law of physics came"}, 0),
        (6, 5, 4, {}, 2),
    ],
)
def test_growth_needs_a_bar_and_a_bar_a_reason(
    number: int, bar: int, before: int, reasons: dict[str, str], faults: int
) -> None:
    key = "statements.a"
    assert len(compare({key: number}, {key: bar}, {key: before}, reasons)) == faults


def test_fifty_statements_more_are_rejected(tmp_path: Path) -> None:
    module = "python/drivetwin/logs/a.py"
    bars = measure(_make_tree({module: "x = 0\n"}))
    bars |= {key: 1000 for key in bars if not key.startswith("statements")}
    budget = "".join(f"{key} = {bar}\n" for key, bar in bars.items())
    for count, faults in ((1, []), (51, ["statements.logs: 51, the budget is 1"])):
        tree = Tree(tmp_path, _make_tree({FILE: budget, module: "x = 0\n" * count}).sources)
        assert [fault.text for fault in check_budget(tree)] == faults


def _make_tree(files: dict[str, str]) -> Tree:
    return Tree(Path(), tuple(Source(PurePosixPath(p), t.encode()) for p, t in files.items()))
