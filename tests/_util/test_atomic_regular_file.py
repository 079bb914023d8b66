# SPDX-License-Identifier: MIT
"""Only regular files are opened; devices, pipes and sockets end at once as typed errors."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from drivetwin import load_card, load_twin
from drivetwin.drive import load_powertrain
from drivetwin.errors import DrivetwinError, FileFormatError
from drivetwin.export.parameters.files import ParameterFormat, read_parameters, read_template
from drivetwin.files.result_file import load_result
from drivetwin.fleet.rules import Sources, read_rules
from drivetwin.gearbox import load_gearbox
from drivetwin.logs.read import read_log, read_raw

READERS: tuple[Callable[[Path], object], ...] = (
    read_raw,
    load_card,
    lambda path: read_log(__file__, None, path),
    load_gearbox,
    load_powertrain,
    read_rules,
    load_twin,
    load_result,
    lambda path: Sources([], path).count(),
    read_template,
    lambda path: read_parameters(path, ParameterFormat.DCM),
)


def make_socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as one:
        one.bind(str(path))


SPECIAL: dict[str, Callable[[Path], object]] = {
    "a folder": Path.mkdir,
    "a named pipe": os.mkfifo,
    "a socket": make_socket,
    "a device": lambda path: path.symlink_to("/dev/zero"),
}


@pytest.mark.parametrize("kind", SPECIAL)
@pytest.mark.parametrize("reader", READERS)
def test_special_files_are_typed_errors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reader: Callable[[Path], object], kind: str
) -> None:
    monkeypatch.chdir(tmp_path)  # the path of a socket is short
    path = Path("file.toml")
    SPECIAL[kind](path)
    with pytest.raises(DrivetwinError, match=f"it is {kind}, not a regular file"):
        reader(path)


@pytest.mark.parametrize("name", ["absent.toml", "with\0nul.toml", "x" * 300 + ".toml"])
@pytest.mark.parametrize("reader", READERS)
def test_paths_that_lead_nowhere(
    tmp_path: Path, reader: Callable[[Path], object], name: str
) -> None:
    with pytest.raises(DrivetwinError, match="cannot read the file"):
        reader(tmp_path / name)


def test_a_loop_of_links(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.symlink_to(path)
    with pytest.raises(FileFormatError, match="cannot read the file"):
        read_raw(path)


@pytest.mark.parametrize("reader", READERS)
def test_a_file_too_large_for_memory(tmp_path: Path, reader: Callable[[Path], object]) -> None:
    path = tmp_path / "file.dcm"
    with path.open("wb") as file:
        file.truncate(2**40)
    with pytest.raises(DrivetwinError, match=r"MB are read|is binary"):
        reader(path)
