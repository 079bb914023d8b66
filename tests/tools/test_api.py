# SPDX-License-Identifier: MIT
"""The page of the Python names says what the docstrings say, of names that are there."""

from __future__ import annotations

import ast
import re
from importlib import import_module

import pytest

from tools.api import PAGE, call, page, rows, summary

SOURCE = '''
class Run:
    """A run | of *one* log, `a*b` apart. It ends with a status."""

    @property
    def size(self) -> int:
        """Number of samples."""

    @classmethod
    def load(cls, path: str, *, strict: bool = True) -> "Run":
        """Read a run.

        Raises ValueError.
        """

    def _hidden(self) -> None:
        """Not shown."""
'''


def test_the_page_is_that_of_the_docstrings() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "write it anew: python -m tools.api"


def sections() -> list[tuple[str, str]]:
    parts = re.split(r"^## `([\w.]+)`$", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return list(zip(parts[1::2], parts[2::2], strict=True))


@pytest.mark.parametrize(("module", "text"), sections(), ids=[name for name, _ in sections()])
def test_every_name_is_there(module: str, text: str) -> None:
    names = re.findall(r"^\| `(\w+)", text, re.MULTILINE)
    assert names
    assert all(hasattr(import_module(module), name) for name in names)


def test_a_class_is_shown_with_its_public_methods() -> None:
    (run,) = ast.parse(SOURCE).body
    assert isinstance(run, ast.ClassDef)
    assert list(rows("Run", run)) == [
        r"| `Run` | A run \| of \*one\* log, `a*b` apart. |",
        "| `Run.size` | Number of samples. |",
        "| `Run.load(path, *, strict=True)` | Read a run. |",
    ]


def test_a_sentence_does_not_end_within_a_formula() -> None:
    (module,) = [ast.parse('"""Torque [N m] of eq. 2 at i.e. 3.5 rad/s. More."""')]
    assert summary(module) == "Torque [N m] of eq. 2 at i.e. 3.5 rad/s."


def test_a_call_names_arguments_without_their_types() -> None:
    (function,) = ast.parse("def f(a: int, *rest: str, b: float = 1.0, **more: int): ...").body
    assert isinstance(function, ast.FunctionDef)
    assert call("f", function) == "f(a, *rest, b=1.0, **more)"
