# SPDX-License-Identifier: MIT
"""Outputs of all commands are checked before the computation."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_type_hints

import pytest

from drivetwin._util.outputs import Output, Shape, select_outputs
from drivetwin.cli import main
from drivetwin.cli.app import COMMANDS
from drivetwin.cli.command_group import CommandGroup, Entry, LazyCommands, build_command
from drivetwin.cli.options import bind_command, find_outputs, get_request
from drivetwin.errors import FileFormatError, InputError


def iterate_commands(entries: dict[str, Entry], path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the name and the function of every command."""
    for name, entry in entries.items():
        if isinstance(entry, CommandGroup):
            commands: LazyCommands = entry.commands
            yield from iterate_commands(dict(commands.entries), f"{name} ")
        else:
            yield path + name, entry


OUTPUTS = [
    (name, parameter, function, marker)
    for name, function in iterate_commands(COMMANDS)
    for parameter, marker in find_outputs(function).items()
]
NAMES = [f"{name} {parameter}" for name, parameter, _, _ in OUTPUTS]


@pytest.mark.parametrize(("name", "parameter", "function", "marker"), OUTPUTS, ids=NAMES)
def test_the_root_is_refused_by_every_output_before_the_computation(
    name: str, parameter: str, function: Any, marker: Output
) -> None:
    with pytest.raises(InputError) as caught:
        bind_command(function)(**{parameter: Path("/")})
    assert caught.value.where.file == "/", name
    assert marker.shape in ("file", "folder", "file or folder")


def test_every_option_that_writes_is_an_output() -> None:
    """Options that write are `-o`, and those whose help has the words."""
    unmarked = []
    for name, function in iterate_commands(COMMANDS):
        marked, hints = find_outputs(function), get_type_hints(get_request(function))
        for option in build_command(name, function).params:
            text = (getattr(option, "help", None) or "").casefold()
            written = "-o" in option.opts or "write" in text.split()
            takes_path = "Path" in str(hints.get(option.name))
            if written and takes_path and option.name not in marked:
                unmarked.append(f"{name} {option.opts}")
    assert unmarked == []
    assert len(OUTPUTS) >= 17


def test_a_path_that_takes_no_file_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "file.csv"
    file.touch()
    for marker, path, text in (
        (Output(), tmp_path, "this is a folder, not a file"),
        (Output(), file / "a.csv", "is a file, so nothing can be in it"),
        (Output(), file / "deep" / "a.csv", "is a file, so nothing can be in it"),
        (Output(Shape.FOLDER), file, "this is a file, not a folder"),
        (Output(Shape.FOLDER), file / "out", "is a file, so nothing can be in it"),
        (Output(Shape.EITHER), Path(), "names no file"),
        (Output(Shape.FOLDER), Path("/.."), "root of the file system"),
        (Output(), Path("/dev/null"), "a device"),
        (Output(endings={".csv": "table", ".html": "page"}), tmp_path / "a.CSVX", "'.CSVX'"),
    ):
        with pytest.raises(InputError, match=text):
            marker.check(path)
    for marker, path in (
        (Output(), file),
        (Output(endings={".csv": "table"}), tmp_path / "new" / "a.CSV"),
        (Output(Shape.FOLDER), tmp_path),
        (Output(Shape.FOLDER), tmp_path / "new" / "deep"),
        (Output(Shape.EITHER), tmp_path / "new"),
    ):
        marker.check(path)


def test_a_folder_without_permission_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "access", lambda path, _: Path(path) != tmp_path)
    for shape in Shape:
        with pytest.raises(InputError, match="no permission to write in"):
            Output(shape).check(tmp_path / "new" / "a")


def test_an_unknown_ending_names_the_kinds(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["synth", "-o", "log.xlsx"]) == 2
    shown = capsys.readouterr()
    assert "log.xlsx: no format has the ending '.xlsx'" in shown.err
    assert ".mf4 (MDF 4)" in shown.err
    with pytest.raises(FileFormatError):
        Output(endings={".csv": "table"}).check(Path("plain"))


def test_outputs_are_selected_by_ending_in_any_case() -> None:
    paths = [Path("a.CSV"), Path("b.html"), Path("c.csv")]
    assert select_outputs(paths, ".csv") == [paths[0], paths[2]]
    assert select_outputs(None, ".csv") == []
