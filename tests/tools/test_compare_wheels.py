# SPDX-License-Identifier: MIT
"""Differences between two builds of the wheel are named."""

from __future__ import annotations

from pathlib import Path
from zipfile import ZipFile, ZipInfo

import pytest

from tools.compare_wheels import find_differences, main

EARLY, LATE = (1980, 1, 1, 0, 0, 0), (2025, 1, 1, 0, 0, 0)


def pack(path: Path, members: dict[str, bytes], time: tuple[int, ...] = EARLY) -> Path:
    with ZipFile(path, "w") as archive:
        for name, data in members.items():
            year, month, day, hour, minute, second = time
            archive.writestr(ZipInfo(name, (year, month, day, hour, minute, second)), data)
    return path


def test_equal_archives_have_no_difference(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = (pack(tmp_path / name, {"a": b"1"}) for name in ("1.whl", "2.whl"))
    assert find_differences(first, second) == []
    assert main([str(first), str(second)]) == 0
    assert "two builds are equal: " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("members", "time", "expected"),
    [
        ({"a": b"2", "b": b""}, EARLY, ["a: contents"]),
        ({"a": b"1", "c": b""}, EARLY, ["b: only in one wheel", "c: only in one wheel"]),
        ({"a": b"1", "b": b""}, LATE, ["a: date_time", "b: date_time"]),
        ({"b": b"", "a": b"1"}, EARLY, ["order of the members, or the archive's own data"]),
    ],
)
def test_each_difference_is_named(
    tmp_path: Path,
    members: dict[str, bytes],
    time: tuple[int, ...],
    expected: list[str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    first = pack(tmp_path / "1.whl", {"a": b"1", "b": b""})
    second = pack(tmp_path / "2.whl", members, time)
    assert find_differences(first, second) == expected
    assert main([str(first), str(second)]) == 1
    assert f"differs: {expected[0]}" in capsys.readouterr().err
