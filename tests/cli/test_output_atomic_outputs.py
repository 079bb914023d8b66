# SPDX-License-Identifier: MIT
"""Output folders change as a whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.cli.output import write_atomically
from drivetwin.errors import FileFormatError, Where


def test_files_appear_together_in_a_new_folder(tmp_path: Path) -> None:
    target = tmp_path / "a" / "b"
    with write_atomically(target) as beside:
        (beside / "one.txt").write_text("1")
        (beside / "two.txt").write_text("2")
        assert not target.exists()
    assert {path.name: path.read_text() for path in target.iterdir()} == {
        "one.txt": "1",
        "two.txt": "2",
    }
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_an_error_names_the_file_where_it_was_to_stand(tmp_path: Path) -> None:
    def fail(named: Path) -> None:
        with write_atomically(tmp_path) as beside:
            raise FileFormatError("no", "do", Where(file=str(beside / named), channel="x"))

    with pytest.raises(FileFormatError) as caught:
        fail(Path("one.mat"))
    assert caught.value.where == Where(file=str(tmp_path / "one.mat"), channel="x")
    with pytest.raises(FileFormatError) as caught:
        fail(Path("/elsewhere/log.csv"))
    assert caught.value.where.file == str(Path("/elsewhere/log.csv"))


@pytest.mark.parametrize("stop", [ValueError, KeyboardInterrupt])
def test_failure_or_interrupt_leaves_everything_as_it_was(
    tmp_path: Path, stop: type[BaseException]
) -> None:
    (tmp_path / "old.txt").write_text("old")

    def fail(target: Path) -> None:
        with write_atomically(target) as beside:
            (beside / "old.txt").write_text("new")
            raise stop

    for target in (tmp_path, tmp_path / "fresh"):
        with pytest.raises(stop):
            fail(target)
    assert [path.name for path in tmp_path.iterdir()] == ["old.txt"]
    assert (tmp_path / "old.txt").read_text() == "old"


def test_an_existing_folder_keeps_its_other_files(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    with write_atomically(tmp_path) as beside:
        (beside / "result.json").write_text("{}")
    assert {path.name for path in tmp_path.iterdir()} == {"mine.txt", "result.json"}


def test_a_folder_that_is_a_file_is_named_as_given(tmp_path: Path) -> None:
    (tmp_path / "afile").touch()
    for folder in (tmp_path / "afile", tmp_path / "afile" / "deep"):
        with pytest.raises(NotADirectoryError) as caught, write_atomically(folder):
            pass
        assert caught.value.filename == str(tmp_path / "afile")


def test_a_refusal_of_the_system_names_the_file_where_it_was_to_stand(tmp_path: Path) -> None:
    def write(name: str) -> None:
        with write_atomically(tmp_path / "out") as beside:
            (beside / name).write_text("1")

    with pytest.raises(FileNotFoundError) as absent:
        write("absent/one.txt")
    assert absent.value.filename == str(tmp_path / "out" / "absent" / "one.txt")
    (tmp_path / "out" / "one.txt").mkdir(parents=True)
    with pytest.raises(IsADirectoryError) as taken:
        write("one.txt")
    assert taken.value.filename == str(tmp_path / "out" / "one.txt")
