# SPDX-License-Identifier: MIT
"""Files appear whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.results.atomic import write_text


def test_replaces_the_old_file_and_leaves_nothing_beside(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "result.json"
    write_text(path, "old")
    write_text(path, "new μ")
    assert path.read_text(encoding="utf-8") == "new μ"
    assert list(path.parent.iterdir()) == [path]


def test_a_failed_write_keeps_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    write_text(path, "old")
    with pytest.raises(UnicodeEncodeError):
        write_text(path, "long text before the fault \ud800")
    assert path.read_text(encoding="utf-8") == "old"
    assert list(tmp_path.iterdir()) == [path]
