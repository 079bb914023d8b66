# SPDX-License-Identifier: MIT
"""Outputs of all commands are checked before the computation."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import get_type_hints

import pytest

from drivetwin._util.request import COMMANDS, get_arguments, lock_outputs
from drivetwin.cli import main
from drivetwin.errors import InputError

ARGUMENTS = [
    (f"{command} {name}", hint, arguments[name])
    for command, request in COMMANDS.items()
    for arguments, hints in [(get_arguments(request), get_type_hints(request))]
    for name, hint in hints.items()
    if name in arguments
]
OUTPUTS = [pytest.param(one, id=name) for name, _, one in ARGUMENTS if one.output is not None]


@pytest.mark.parametrize("argument", OUTPUTS)
def test_the_root_is_refused_by_every_output(argument: object) -> None:
    output = getattr(argument, "output")  # noqa: B009
    with pytest.raises(InputError) as caught:
        output.check(Path("/"))
    assert caught.value.where.file == "/"


def test_every_option_that_writes_is_an_output() -> None:
    """Options that write are `-o`, and those whose help has the words."""
    for name, hint, one in ARGUMENTS:
        if "Path" in str(hint) and ("-o" in one.names or "write" in one.help.casefold().split()):
            assert one.output is not None, name
    assert len(OUTPUTS) >= 17


@pytest.mark.parametrize(
    ("command", "path", "text"),
    [
        ("synth", "", "this is a folder, not a file"),
        ("synth", "file.csv/a.csv", "is a file, so nothing can be in it"),
        ("synth", "file.csv/deep/a.csv", "is a file, so nothing can be in it"),
        ("synth", "a.CSVX", "no format has the ending '.CSVX'"),
        ("synth", "log.xlsx", ".mf4 (MDF 4)"),
        ("synth", "plain", "no format has the ending ''"),
        ("synth", "locked/new/a.csv", "no permission to write in"),
        ("gearbox three-set-3000", "/dev/null", "a device"),
        ("demo", "file.csv", "this is a file, not a folder"),
        ("demo", "file.csv/out", "is a file, so nothing can be in it"),
        ("demo", "/..", "root of the file system"),
        ("demo", "locked/new/a", "no permission to write in"),
    ],
)
def test_a_path_that_takes_no_output_is_refused(
    command: str,
    path: str,
    text: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "file.csv").touch()
    (tmp_path / "locked").mkdir()
    monkeypatch.setattr(os, "access", lambda place, _: Path(place) != tmp_path / "locked")
    assert main([*command.split(), "-o", str(tmp_path / path)]) == 2
    assert text in capsys.readouterr().err


def test_the_second_writer_is_told_and_may_come_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (locks := tmp_path / "locks").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(locks))
    with lock_outputs([tmp_path / "out"]):
        assert len(list(locks.iterdir())) == 1
        with (
            pytest.raises(InputError, match="another command is writing"),
            lock_outputs([tmp_path / "other", tmp_path / "x" / ".." / "out"]),
        ):
            pass
        with lock_outputs([tmp_path / "other"]):
            pass
    with lock_outputs([tmp_path / "out"]):
        pass
    assert list(locks.iterdir()) == []
