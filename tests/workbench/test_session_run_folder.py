# SPDX-License-Identifier: MIT
"""Folders of runs: those of living runs stay, those of dead ones are removed."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from drivetwin.workbench.session import RunFolder, remove_dead_folders

_LIVING = """
from drivetwin.workbench.session import RunFolder
folder = RunFolder.create()
print(folder.path, flush=True)
input()
"""


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    return tmp_path


def test_a_run_removes_its_folder() -> None:
    folder = RunFolder.create()
    (folder.path / "inner").mkdir()
    assert folder.path.stat().st_mode & 0o077 == 0
    assert remove_dead_folders() == []
    folder.remove()
    assert not folder.path.exists()


def test_the_folder_of_another_process_goes_once_that_is_killed() -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", _LIVING], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    path = Path(process.stdout.readline().strip())
    (path / "upload").write_text("x")
    assert remove_dead_folders() == []
    assert path.exists()
    process.kill()
    process.communicate()
    assert path.exists()
    assert remove_dead_folders() == [path]
    assert not path.exists()


def test_what_is_no_folder_of_a_run_stays(temporary: Path) -> None:
    target = temporary / "target"
    target.mkdir()
    (target / "lock").touch()
    (temporary / "drivetwin-app-link").symlink_to(target)
    (temporary / "drivetwin-app-bare").mkdir()
    (temporary / "drivetwin-app-file").touch()
    (temporary / "other").mkdir()
    assert remove_dead_folders() == []
    assert len(list(temporary.iterdir())) == 5
