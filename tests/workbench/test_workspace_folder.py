# SPDX-License-Identifier: MIT
"""No name leads out of the folder, however it is written."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.errors import RefusedError
from drivetwin.workbench.workspace import Folder


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    root = tmp_path / "root"
    (root / "inner").mkdir(parents=True)
    (root / "inner" / "log.csv").write_text("x")
    (root / ".hidden.csv").write_text("x")
    (tmp_path / "secret.csv").write_text("x")
    (root / "out.csv").symlink_to(tmp_path / "secret.csv")
    (root / "outer").symlink_to(tmp_path)
    (root / "alias.csv").symlink_to(root / "inner" / "log.csv")
    return Folder.from_path(root)


@pytest.mark.parametrize("name", ["inner/log.csv", " inner/log.csv ", "inner/../inner/log.csv"])
def test_a_file_of_the_folder_is_found(folder: Folder, name: str) -> None:
    path = folder.get_file(name)
    assert path.read_text() == "x"
    assert folder.get_name(path) == "inner/log.csv"


def test_links_and_absolute_paths_inside_are_followed(folder: Folder) -> None:
    assert folder.get_file("alias.csv") == folder.root / "inner" / "log.csv"
    assert folder.get_file(str(folder.root / "inner" / "log.csv")).is_file()


@pytest.mark.parametrize(
    "name",
    ["../secret.csv", "inner/../../secret.csv", "out.csv", "outer/secret.csv", "/etc/passwd", "",
     "  ", "inner", "absent.csv", "a\0b", "x" * 5000, "~/x", "//etc/passwd", "/dev/null"],
)  # fmt: skip
def test_what_leads_elsewhere_is_refused(folder: Folder, name: str) -> None:
    with pytest.raises(RefusedError):
        folder.get_file(name)


@given(name=st.text(max_size=60))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_text_is_a_file_inside_or_refused(folder: Folder, name: str) -> None:
    try:
        path = folder.get_file(name)
    except RefusedError:
        return
    assert path.is_relative_to(folder.root)


def test_new_files_stay_inside_and_get_their_ending(folder: Folder) -> None:
    assert folder.make_new_path("work", ".workspace.json") == folder.root / "work.workspace.json"
    os.mkfifo(folder.root / "pipe.workspace.json")
    for name in ("../work", "absent/work", "", ".workspace.json", "outer/work", "pipe"):
        with pytest.raises(RefusedError):
            folder.make_new_path(name, ".workspace.json")


def test_names_for_completion_leave_hidden_and_foreign_files_out(folder: Folder) -> None:
    names = folder.list_names((".csv",))
    assert "inner/log.csv" in names
    assert all(not Path(name).name.startswith(".") for name in names)
    assert not any(name.startswith("outer/") for name in names)


def test_a_folder_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RefusedError):
        Folder.from_path(tmp_path / "absent")
