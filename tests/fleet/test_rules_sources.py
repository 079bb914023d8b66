# SPDX-License-Identifier: MIT
"""Files, folders, globs and lists: the same files in the same order, each time."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.errors import InputError
from drivetwin.fleet.rules import Sources


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with logs and other files."""
    for name in ("b/2.csv", "b/1.mf4", "a/3.CSV", "a/notes.md", ".git/4.csv", "a/.5.csv", "6.json"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("x")
    return tmp_path


def _names(sources: Sources) -> list[str]:
    return [source.path.name for source in sources]


def test_a_folder_gives_its_logs_in_order(folder: Path) -> None:
    sources = Sources([str(folder)])
    assert _names(sources) == ["3.CSV", "1.mf4", "2.csv"]
    assert _names(sources) == _names(sources)
    assert sources.count() == 3
    assert all(source.path.is_absolute() for source in sources)


def test_a_store_among_the_logs_is_left_out(folder: Path) -> None:
    (folder / "store" / "rows").mkdir(parents=True)
    (folder / "store" / "index.sqlite").write_text("x")
    (folder / "store" / "rows" / "all.parquet").write_text("x")
    assert _names(Sources([str(folder)])) == ["3.CSV", "1.mf4", "2.csv"]


def test_files_and_globs_may_be_anything(folder: Path) -> None:
    assert _names(Sources([str(folder / "6.json")])) == ["6.json"]
    assert _names(Sources([str(folder / "**" / "*.csv")])) == ["2.csv"]
    assert _names(Sources([str(folder / "?" / "*")])) == ["3.CSV", "notes.md", "1.mf4", "2.csv"]


def test_a_name_that_stands_for_nothing_is_told(folder: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        Sources([str(folder / "*.blf")]).count()


def test_a_list_names_files_and_what_belongs_to_them(folder: Path) -> None:
    listed = folder / "list.csv"
    listed.write_text("path,unit,odometer\nb/2.csv,T1,100\na/3.CSV,T2,\n")
    assert [(source.path, source.stated) for source in Sources([], listed)] == [
        (folder / "b/2.csv", {"unit": "T1", "odometer": "100"}),
        (folder / "a/3.CSV", {"unit": "T2"}),
    ]
    listed.write_text("b/2.csv\n\na/3.CSV\n")
    assert _names(Sources([], listed)) == ["2.csv", "3.CSV"]


@pytest.mark.parametrize("content", [None, b"\xff\xfe\x00", b"path,a\n\xff"])
def test_a_list_that_cannot_be_read_is_told(folder: Path, content: bytes | None) -> None:
    listed = folder / "list.csv"
    if content is not None:
        listed.write_bytes(content)
    with pytest.raises(InputError, match=r"cannot be read|cannot read the file"):
        Sources([], listed).count()


@pytest.mark.parametrize("line", ["T2", "T2,"])
def test_a_line_of_a_list_without_a_path_is_told(folder: Path, line: str) -> None:
    listed = folder / "list.csv"
    listed.write_text(f"unit,path\nT1,b/2.csv\n\n{line}\n")
    with pytest.raises(InputError, match="line 4 names no path"):
        Sources([], listed).count()
