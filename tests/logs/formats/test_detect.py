# SPDX-License-Identifier: MIT
"""Formats without a reader are told by their names."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.errors import FileFormatError
from drivetwin.logs.formats.detect import open_recording


@pytest.mark.parametrize(
    ("head", "name"),
    [
        (b"\x89HDF\r\n\x1a\n", "an HDF5 file without MATLAB header"),
        (b"\x1f\x8b\x08", "a gzip archive"),
    ],
)
def test_what_has_no_reader_is_told_by_name(tmp_path: Path, head: bytes, name: str) -> None:
    path = tmp_path / "log"
    path.write_bytes(head)
    with pytest.raises(FileFormatError, match=f"this is {name}") as caught:
        open_recording(path)
    assert "BLF" in caught.value.remedy
