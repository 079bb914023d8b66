# SPDX-License-Identifier: MIT
"""Folders of runs: those of living runs stay, those of killed ones go at the next start."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from drivetwin.workbench.session import make_run_folder

_LIVING = """
from drivetwin.workbench.session import make_run_folder
print(make_run_folder(), flush=True)
input()
"""


def test_the_folder_of_another_process_goes_once_that_is_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    (tmp_path / ".drivetwin-link").symlink_to(tmp_path)
    process = subprocess.Popen(
        [sys.executable, "-c", _LIVING], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    path = Path(process.stdout.readline().strip())
    assert path.stat().st_mode & 0o077 == 0
    (path / "upload").write_text("x")
    shutil.rmtree(make_run_folder())
    assert path.exists()
    process.kill()
    process.communicate()
    own = make_run_folder()
    assert {one.name for one in tmp_path.iterdir()} == {own.name, ".drivetwin-link"}
