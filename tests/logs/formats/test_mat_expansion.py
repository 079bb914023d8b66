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
from tests.workbench.bad_files import mat_bomb

LIMIT = 2**31


@pytest.mark.parametrize("compressed", [True, False])
def test_a_sound_file_claims_about_what_it_holds(tmp_path: Path, compressed: bool) -> None:
    path = tmp_path / "log.mat"
    savemat(path, {"a": np.zeros(10_000), "b": np.ones(5)}, do_compression=compressed)
    refuse_expansion(path, 81_000)
    with pytest.raises(ReaderFailureError, match="expands"):
        refuse_expansion(path, 79_000)


def test_a_bomb_is_refused_without_being_expanded(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    path.write_bytes(mat_bomb())
    with pytest.raises(ReaderFailureError, match=r"3\.1 GB"):
        refuse_expansion(path, LIMIT)


@given(rest=st.binary(max_size=200))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_bytes_after_the_header_are_read_or_refused(tmp_path: Path, rest: bytes) -> None:
    path = tmp_path / "log.mat"
    path.write_bytes(b"MATLAB 5.0".ljust(124) + b"\0\1IM" + rest)
    with suppress(ReaderFailureError):
        refuse_expansion(path, LIMIT)


def test_other_formats_are_left_to_their_readers(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(b"time,a\n")
    refuse_expansion(path, 0)
