# SPDX-License-Identifier: MIT
"""No command writes over what it reads."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from drivetwin.cli import main
from tests.cli.conftest import Files


@pytest.fixture
def folder(bench_files: Files, tmp_path: Path) -> Path:
    """A log, the same by a link, and a card, to be read in this folder."""
    shutil.copy(bench_files.log, tmp_path / "log.csv")
    shutil.copy(bench_files.card, tmp_path / "log.card.toml")
    (tmp_path / "link.csv").symlink_to(tmp_path / "log.csv")
    return tmp_path


@pytest.mark.parametrize("output", ["log.csv", "link.csv", "log.card.toml"])
def test_an_output_that_is_an_input_is_refused(
    folder: Path, output: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    log, card = str(folder / "log.csv"), str(folder / "log.card.toml")
    written = str(folder / output)
    assert main(["inspect", log, "--vehicle", card, "--write-mapping", written]) == 2
    shown = capsys.readouterr()
    assert shown.err.startswith(f"error: {written}: this file is read by the same command")
    assert shown.out == ""
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_it_is_refused_before_anything_is_computed(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "no.toml").write_text("this is no twin")
    both = [str(folder / "no.toml"), str(folder / "log.csv")]
    assert main(["simulate", *both, "-o", both[1]]) == 2
    assert "log.csv: this file is read by the same command" in capsys.readouterr().err
    assert main(["observe", *both, "-o", both[0]]) == 2
    assert "no.toml: this file is read by the same command" in capsys.readouterr().err


def test_an_earlier_result_is_replaced(folder: Path) -> None:
    command = ["inspect", str(folder / "log.csv"), "--write-mapping", str(folder / "map.toml")]
    assert main(command) == 0
    text = (folder / "map.toml").read_text()
    (folder / "map.toml").write_text("old")
    assert main(command) == 0
    assert (folder / "map.toml").read_text() == text
    assert main([*command, "--channels", str(folder / "map.toml")]) == 2
    assert (folder / "map.toml").read_text() == text


def test_a_folder_with_an_input_stays_as_it_was(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of three files that would be written one is the card: none is."""
    card = folder / "out" / "twin.toml"
    card.parent.mkdir()
    shutil.copy(folder / "log.card.toml", card)
    command = ["identify", str(folder / "log.csv"), "--vehicle", str(card), "--method", "paper"]
    assert main([*command, "-o", str(card.parent)]) == 2
    assert f"{card}: this file is read by the same command" in capsys.readouterr().err
    assert [path.name for path in card.parent.iterdir()] == ["twin.toml"]
    assert card.read_bytes() == (folder / "log.card.toml").read_bytes()
