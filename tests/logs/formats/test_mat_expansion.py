# SPDX-License-Identifier: MIT
"""Small MATLAB files that expand to gigabytes end in the limits of the process that reads them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from drivetwin.errors import FileFormatError, ReaderFailureError
from drivetwin.logs.read import read_raw
from tests.workbench.bad_files import hdf5_bomb, mat_bomb


@pytest.mark.parametrize("make", [mat_bomb, hdf5_bomb])
def test_a_bomb_is_a_typed_error_of_the_reader(tmp_path: Path, make: Callable[[], bytes]) -> None:
    path = tmp_path / "log.mat"
    path.write_bytes(make())
    with pytest.raises((ReaderFailureError, FileFormatError)) as caught:
        read_raw(path)
    assert "again" in caught.value.remedy
