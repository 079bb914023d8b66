# SPDX-License-Identifier: MIT
"""One writer for each output path at a time."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest

from drivetwin._util.outputs import lock_outputs
from drivetwin.errors import InputError


def test_the_second_is_told_and_may_come_later(tmp_path: Path) -> None:
    with lock_outputs([tmp_path / "out"]):
        with (
            pytest.raises(InputError, match="another command is writing"),
            lock_outputs([tmp_path / "other", tmp_path / "x" / ".." / "out"]),
        ):
            pass
        with lock_outputs([tmp_path / "other"]):
            pass
    with lock_outputs([tmp_path / "out"]):
        pass


def test_no_lock_file_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with lock_outputs([tmp_path / "out"]):
        assert len(list(tmp_path.iterdir())) == 1
    assert list(tmp_path.iterdir()) == []
