# SPDX-License-Identifier: MIT
"""Uploads: counted while they come in, named by us, left on disk only where they are accepted."""

from __future__ import annotations

import threading
import time
from io import BytesIO
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import RefusedError
from drivetwin.workbench.workspace import find_formula, make_label, refuse_formulas, store_stream
from tests.support.repeats import mark_repeats

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


@pytest.mark.parametrize(
    "cell",
    ["=1+1", "=cmd|' /C calc'!A0", "@SUM(A1)", '"=HYPERLINK(1)"', "+cmd|' /C calc'!A0",
     "-2+3+cmd|' /C calc'!A0", " =A1", "-A1"],
)  # fmt: skip
@pytest.mark.parametrize("where", ["{},n\n0,1\n", "time,n\ns,rpm\n0,{}\n", "t;n\n{};1\n"])
def test_cells_that_a_spreadsheet_computes_are_refused(
    tmp_path: Path, cell: str, where: str
) -> None:
    path = tmp_path / "log.csv"
    path.write_text(where.format(cell))
    with pytest.raises(RefusedError, match="formula"):
        refuse_formulas(path, "log.csv")


PARTS = (b"\n", b",", b" ", b"-", b"+", b", ", b'"', b",-ax", b",-1", b"+inf,")


@pytest.mark.timeout(60)
@pytest.mark.parametrize("part", mark_repeats(PARTS, (b"\n", b",-ax")))
def test_the_check_takes_time_by_the_size_alone(tmp_path: Path, part: bytes) -> None:
    """20 MB of any such part; of newlines it took 52 s."""
    path = tmp_path / "log.csv"
    path.write_bytes(b"0" + part * (20 * 2**20 // len(part)))
    found: list[object] = []
    begun = time.process_time()
    find_formula(found.append, path)
    assert time.process_time() - begun < 5.0
    assert found == [1 if part == b",-ax" else None]


def test_the_server_answers_while_an_upload_is_checked(tmp_path: Path) -> None:
    """The search holds the interpreter, so that it may not run in the server."""
    content = b"0" + b"\n" * (20 * 2**20)
    upload = threading.Thread(
        target=store_stream, args=(BytesIO(content), "log.csv", None, tmp_path / "key", 2**30)
    )
    upload.start()
    slowest, last = 0.0, time.monotonic()
    while upload.is_alive():
        time.sleep(0.01)
        slowest, last = max(slowest, time.monotonic() - last), time.monotonic()
    assert slowest < 1.0


def test_numbers_and_names_are_no_formulas(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(TABLE + b"# a comment: x = 3\n1e-3,-1,5\n-.5;+.5\n")
    refuse_formulas(path, "log.csv")
    path.write_bytes(b"MDF     \0\0=1+1,=2\n")
    refuse_formulas(path, "a measurement file")
