# SPDX-License-Identifier: MIT
"""The program as a whole: help, version, exit codes, error texts, light imports."""

from __future__ import annotations

import ast
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.core import TyperGroup

from drivetwin._util.request import COMMANDS as REQUESTS
from drivetwin._util.request import Request, get_arguments
from drivetwin.cli import app, main
from drivetwin.errors import InputError


def commands(group: object, *before: str) -> Iterator[tuple[str, ...]]:
    """Every command as it is called, those of groups too."""
    if isinstance(group, TyperGroup):
        for name, command in group.commands.items():
            yield from commands(command, *before, name)
    else:
        yield before


COMMANDS = tuple(commands(typer.main.get_command(app)))


@pytest.mark.parametrize("group", [(), ("fleet",), ("card",)], ids=" ".join)
def test_a_group_without_a_command_prints_its_help(
    group: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(group) == 2
    assert "\nCommands:\n" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "call"), [(k, one) for k in REQUESTS for one in REQUESTS[k].examples]
)
def test_every_example_is_a_call_of_its_command(name: str, call: str) -> None:
    assert main_parses(shlex.split(call)) == name


def main_parses(arguments: list[str]) -> str:
    """Parse a call as the program does, without running it; return the name of the command."""
    command: Any = typer.main.get_command(app)
    context = command.make_context("drivetwin", arguments)
    while isinstance(command, TyperGroup):
        name, command, arguments = command.resolve_command(
            context, [*context._protected_args, *context.args]
        )
        context = command.make_context(name, arguments, parent=context)
    path = str(context.command_path).removeprefix("drivetwin ")
    request = REQUESTS[path]
    values = {
        key: value
        for key, value in context.params.items()
        if context.get_parameter_source(key).name == "COMMANDLINE" and key in get_arguments(request)
    }
    request(**{**dict.fromkeys(_list_required(request), "x"), **values})
    return path


def _list_required(request: type[Request]) -> list[str]:
    return [one.name for one in fields(request) if one.default is MISSING]


EXCLUSIONS = [
    (name, argument, other)
    for name, request in REQUESTS.items()
    for argument, declared in get_arguments(request).items()
    for other in declared.excludes
]


@pytest.mark.parametrize(("name", "argument", "other"), EXCLUSIONS)
def test_options_that_exclude_each_other_are_refused(name: str, argument: str, other: str) -> None:
    request = REQUESTS[name]
    given = dict.fromkeys([*_list_required(request), argument, other], "x")
    with pytest.raises(InputError, match=f"--{other.replace('_', '-')} has no effect here"):
        request(**given)


PYTHON_TYPE = re.compile(
    r"<(?:list|str|int|float|bool|path|Path|tuple|dict|text)\b[^>]*>|\b(?:list|dict|tuple)\[", re.I
)


@pytest.mark.parametrize("call", [(), *COMMANDS], ids=" ".join)
def test_help_of_every_command_is_for_people(
    call: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*call, "--help"]) == 0
    text = capsys.readouterr().out
    assert "Usage: drivetwin" in text
    assert PYTHON_TYPE.findall(text) == []
    assert "`" not in text
    assert "None" not in text
    if call:
        assert ("--json" in text) == (call != ("app",))
        assert max(map(len, text.splitlines())) <= 80
        assert "\n  Examples:\n    drivetwin " in text
        assert "\n  Exit codes:\n      0  done\n" in text
        assert ("--strict" in text) == ("\n      3  " in text)
    else:
        assert all(f"\n  {command} " in text for command, *_ in COMMANDS)
        assert "..." not in text.partition("Commands:")[2]


def test_choices_and_numbers_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "--help"]) == 0
    shown = capsys.readouterr().out
    assert "--to <c|fmu|modelica|" in shown
    assert main(["fleet", "run", "--help"]) == 0
    assert "--workers N " in capsys.readouterr().out


SOURCES = Path(__file__).parents[2] / "python" / "drivetwin"
NO_MESSAGES = {
    "modeling/model_components.py",
    "workbench/views/page.py",
}
"""Sources whose backticks reach no terminal: docstrings of methods, templates of JavaScript."""


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
        for path in sorted(SOURCES.rglob("*.py"))
        if (name := path.relative_to(SOURCES).as_posix()) not in NO_MESSAGES
        for line, text in iterate_texts(path)
        if "`" in text
    ]
    assert marked == []


def test_wrong_usage_is_exit_code_2(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["shifts", "--no-such-option"]) == 2
    assert "--no-such-option" in capsys.readouterr().err


def test_import_is_light() -> None:
    """Help must come at once: nothing numerical is loaded before a command needs it."""
    heavy = "numpy", "scipy", "plotly", "pandas", "pydantic", "jinja2", "tomlkit"
    code = f"import sys, drivetwin.cli; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_path_that_cannot_be_written_is_an_error_with_a_remedy(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    assert main(["synth", "-o", str(tmp_path / "file" / "log.csv")]) == 2
    message = capsys.readouterr().err
    assert "file" in message
    assert "->" in message
    assert "Traceback" not in message
