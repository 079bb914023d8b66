# SPDX-License-Identifier: MIT
"""The program as a whole: help, version, exit codes, error texts, light imports."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer
from typer.core import TyperGroup

from drivetwin.cli import app, main
from drivetwin.cli.output import show_error
from drivetwin.errors import UnitError, Where


def commands(group: object, *before: str) -> Iterator[tuple[str, ...]]:
    """Every command as it is called, those of groups too."""
    if isinstance(group, TyperGroup):
        for name, command in group.commands.items():
            yield from commands(command, *before, name)
    else:
        yield before


COMMANDS = tuple(commands(typer.main.get_command(app)))


def test_help_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    text = capsys.readouterr().out
    assert all(f"\n  {command} " in text for command, *_ in COMMANDS)
    assert "..." not in text.partition("Commands:")[2]


@pytest.mark.parametrize("group", [(), ("fleet",), ("card",)], ids=" ".join)
def test_a_group_without_a_command_prints_its_help(
    group: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(group) == 2
    assert "\nCommands:\n" in capsys.readouterr().err


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_every_command_has_help_and_all_but_the_workbench_json(
    command: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*command, "--help"]) == 0
    text = capsys.readouterr().out
    assert ("--json" in text) == (command != ("app",))
    # A list of choices is one word.
    assert max(len(line) for line in text.splitlines() if "|" not in line) <= 80


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("drivetwin ")


def test_wrong_usage_is_exit_code_2(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["shifts", "--no-such-option"]) == 2
    assert "--no-such-option" in capsys.readouterr().err


def test_import_is_light() -> None:
    """Help must come at once: nothing numerical is loaded before a command needs it."""
    heavy = "numpy", "scipy", "plotly", "pandas", "pydantic", "jinja2", "tomlkit"
    code = f"import sys, drivetwin.cli; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_error_text_says_place_fault_and_remedy(capsys: pytest.CaptureFixture[str]) -> None:
    error = UnitError("unknown unit 'Nn'", "write Nm", Where(file="a [1].csv", channel="Trq"))
    show_error(error, as_json=False)
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err == ("error: a [1].csv, channel 'Trq': unknown unit 'Nn'\n  -> write Nm\n")


def test_error_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    show_error(UnitError("w", "r", Where(file="a.csv", time=0.5)), as_json=True)
    captured = capsys.readouterr()
    assert json.loads(captured.out) == {
        "error": {
            "type": "UnitError",
            "what": "w",
            "where": {"file": "a.csv", "time": 0.5},
            "remedy": "r",
        }
    }
    assert captured.err == ""


def test_a_path_that_cannot_be_written_is_an_error_with_a_remedy(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    assert main(["synth", "-o", str(tmp_path / "file" / "log.csv")]) == 2
    message = capsys.readouterr().err
    assert "file" in message
    assert "->" in message
    assert "Traceback" not in message


def test_interrupt_is_exit_code_130(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("drivetwin.dyno.files.format_truth", interrupted)
    monkeypatch.chdir(tmp_path)
    assert main(["synth", "-o", "out/log.csv"]) == 130
    assert list(tmp_path.iterdir()) == []
