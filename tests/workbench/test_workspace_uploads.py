# SPDX-License-Identifier: MIT
"""Uploads: counted while they come in, named by us, left on disk only where they are accepted."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import RefusedError
from drivetwin.workbench.workspace import make_label, store_stream

LIMIT = 1000
TABLE = b"time,n_in\ns,rpm\n0.0,-1.5\n0.1,+2\n0.2,-inf\n0.3,-nan\n"


@pytest.mark.parametrize(
    ("content", "claimed", "says"),
    [(b"", 0, "empty"), (b"x" * 1001, None, "more"), (b"x", 10**10, "10000 MB"),
     (b"x" * 5, 9, "5 of 9 bytes"), (b"x" * 1001, 3, "more")],
)  # fmt: skip
def test_sizes_that_do_not_fit_are_refused(
    tmp_path: Path, content: bytes, claimed: int | None, says: str
) -> None:
    with pytest.raises(RefusedError, match=says):
        store_stream(BytesIO(content), "log.csv", claimed, tmp_path / "key", LIMIT)
    assert not (tmp_path / "key").exists()


@pytest.mark.parametrize(
    "name",
    ["../log.csv", "..\\log.csv", "/etc/passwd", "C:\\log.csv", ".bashrc", "", "  ", "a\0b.csv",
     "a\nb.csv", "x" * 201, "\uff0e\uff0e\uff0flog.csv", "log\u202ecsv.exe", "a/b", "con|x"],
)  # fmt: skip
def test_names_that_are_paths_are_refused(name: str) -> None:
    with pytest.raises(RefusedError):
        make_label(name)


@given(st.text())
def test_an_accepted_name_is_one_part_of_a_path(name: str) -> None:
    try:
        label = make_label(name)
    except RefusedError:
        return
    assert Path(label).name == label
