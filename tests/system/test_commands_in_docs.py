# SPDX-License-Identifier: MIT
"""Commands and code in the documents work as printed."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
import typer
from typer.core import TyperGroup

from drivetwin.cli import app, main

ROOT = Path(__file__).resolve().parents[2]
README = ROOT / "README.md"
DOCUMENTS = (README, *sorted((ROOT / "docs").rglob("*.md")))
COMMANDS = typer.main.get_command(app)


def command_lines() -> list[str]:
    """Every indented line of the documents that calls the program, continued lines joined."""
    texts = (re.sub(r"\\\n +", "", document.read_text(encoding="utf-8")) for document in DOCUMENTS)
    return [line for text in texts for line in re.findall(r"^ {4,}drivetwin (.*)$", text, re.M)]


def test_the_table_of_the_readme_names_the_commands() -> None:
    named = re.findall(r"^\| `drivetwin (\w+)` \|", README.read_text(encoding="utf-8"), re.M)
    assert isinstance(COMMANDS, TyperGroup)
    assert named == list(COMMANDS.commands)


@pytest.mark.parametrize("line", command_lines())
def test_a_printed_command_is_one_that_the_program_takes(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # files of the same names do not matter
    name, *arguments = shlex.split(line)
    assert isinstance(COMMANDS, TyperGroup)
    command = COMMANDS.commands[name]
    if isinstance(command, TyperGroup):
        named = arguments if arguments[0] in command.commands else ["run", *arguments]
        name, *arguments = named
        command = command.commands[name]
    with command.make_context(name, arguments) as context:
        assert context.params


def test_the_example_of_the_readme_runs_as_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    text = README.read_text(encoding="utf-8")
    (example,) = re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)
    assert main(["synth", "-o", str(tmp_path / "shift.csv")]) == 0
    exec(compile(example, str(README), "exec"), {"__name__": "__main__"})
    shown = capsys.readouterr().out
    assert re.search(r"^eta 0\.8\d+ \(.*\) 1 identified$", shown, re.M)
    assert "fit_percent" in shown
