# SPDX-License-Identifier: MIT
"""Help of all commands, which groups build: no types of Python, no marks of documents."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import drivetwin
from drivetwin.cli import main
from drivetwin.cli.app import COMMANDS
from drivetwin.cli.command_group import CommandGroup

PACKAGE = Path(drivetwin.__file__).parent
GROUPS = {name: one for name, one in COMMANDS.items() if isinstance(one, CommandGroup)}
CALLS = [
    (),
    *((name,) for name in COMMANDS),
    *((name, one) for name, group in GROUPS.items() for one in group.commands),
]
PYTHON_TYPE = re.compile(
    r"<(?:list|str|int|float|bool|path|Path|tuple|dict|text)\b[^>]*>|\b(?:list|dict|tuple)\[", re.I
)
NO_MESSAGES = {"modeling/element_help.py", "workbench/views/page.py", "workbench/views/zooming.py"}
"""Sources whose backticks reach no terminal: docstrings of methods, templates of JavaScript."""


@pytest.mark.parametrize("call", CALLS, ids=" ".join)
def test_help_has_no_types_of_python_and_no_backticks(
    call: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*call, "--help"]) == 0
    shown = capsys.readouterr().out
    assert "Usage: drivetwin" in shown
    assert PYTHON_TYPE.findall(shown) == []
    assert "`" not in shown
    assert "None" not in shown


def test_choices_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "--help"]) == 0
    shown = capsys.readouterr().out
    assert "--to <c|fmu|modelica|" in shown
    assert "--platform <linux|windows|macos|" in shown
    assert main(["fleet", "run", "--help"]) == 0
    assert "--workers N " in capsys.readouterr().out


def iterate_texts(path: Path) -> Iterator[tuple[int, str]]:
    """Yield the texts of a source that are no docstrings, with their lines."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    bodies = (body for node in ast.walk(tree) if isinstance(body := getattr(node, "body", 0), list))
    docstrings = {id(one.value) for body in bodies for one in body if isinstance(one, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and id(node) not in docstrings:
            yield node.lineno, str(node.value)


def test_no_text_of_the_package_has_backticks() -> None:
    """Errors, findings, notes and help: a terminal prints backticks as they are."""
    marked = [
        f"{name}:{line}"
        for path in sorted(PACKAGE.rglob("*.py"))
        if (name := path.relative_to(PACKAGE).as_posix()) not in NO_MESSAGES
        for line, text in iterate_texts(path)
        if "`" in text
    ]
    assert marked == []
