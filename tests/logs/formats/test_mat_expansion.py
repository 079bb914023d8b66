# SPDX-License-Identifier: MIT
"""Declared size of a compressed MATLAB file: of files that SciPy writes, and of a bomb."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from drivetwin.errors import ReaderFailureError
from drivetwin.logs.formats.mat import refuse_expansion
from drivetwin.logs.read import read_raw
from tests.workbench.bad_files import hdf5_bomb, mat_bomb

LIMIT = 2**31


@pytest.mark.parametrize("compressed", [True, False])
def test_a_sound_file_claims_about_what_it_holds(tmp_path: Path, compressed: bool) -> None:
    path = tmp_path / "log.mat"
    savemat(path, {"a": np.zeros(10_000), "b": np.ones(5)}, do_compression=compressed)
    refuse_expansion(path, 81_000)
    with pytest.raises(ReaderFailureError, match="expand to"):
        refuse_expansion(path, 79_000)


def test_a_bomb_is_refused_without_being_expanded(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    path.write_bytes(mat_bomb())
    with pytest.raises(ReaderFailureError, match="GB or more"):
        refuse_expansion(path, LIMIT)


@pytest.mark.parametrize("nested", [False, True])
def test_small_whole_numbers_grow_to_float64(tmp_path: Path, nested: bool) -> None:
    """0.1 MB of constant signals that take 1.1 GB as numbers."""
    signal = np.zeros(70_000_000, np.int8)
    held = {"time": signal, "data": signal}
    path = tmp_path / "log.mat"
    savemat(path, {"log": {"inner": held}} if nested else held, do_compression=True)
    assert path.stat().st_size < 300_000
    with pytest.raises(ReaderFailureError, match=r"0\.56 GB or more.* is 0\.54 GB") as caught:
        read_raw(path)
    assert "only the channels that are needed" in caught.value.remedy


def test_a_file_of_version_7_3_is_refused_by_the_size_of_its_data(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    path.write_bytes(hdf5_bomb())
    with pytest.raises(ReaderFailureError, match="expand to 32"):
        read_raw(path)


@given(rest=st.binary(max_size=200))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_bytes_after_the_header_are_read_or_refused(tmp_path: Path, rest: bytes) -> None:
    path = tmp_path / "log.mat"
    path.write_bytes(b"MATLAB 5.0".ljust(124) + b"\0\1IM" + rest)
    with suppress(ReaderFailureError):
        refuse_expansion(path, LIMIT)
