# SPDX-License-Identifier: MIT
"""Kinds of files by content, whatever they are called."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin._util.request import FileRole
from drivetwin.cli.input_files import recognise_file, require_kind
from drivetwin.errors import CardError, FileFormatError, ResultFileError

CARD = 'name = "truck"\nfinal_drive = 5.0\n[[gears]]\nname = "2"\n[elements.B2]\nP0_bar = 0.8\n'
TWIN = 'schema = "drivetwin/twin-2"\nname = "truck"\n[gears]\n[elements]\n'
CONTENTS = {
    "comma": ("time,torque\ns,Nm\n0.0,1.5\n0.1,1.6\n", FileRole.LOG),
    "german": ("Zeit;M_ist\ns;Nm\n0,0;1,5\n0,1;1,6\n", FileRole.LOG),
    "tabs": ("t\tM\n0\t-1.5e3\n", FileRole.LOG),
    "asc": ("date Mon\n0.01 1 2 3\n", FileRole.LOG),
    "mdf": ("MDF     4.10    ", FileRole.LOG),
    "parquet": ("PAR1....", FileRole.LOG),
    "card": (CARD, FileRole.CARD),
    "commented card": ("# a card\n\n" + CARD, FileRole.CARD),
    "twin": (TWIN, FileRole.TWIN),
    "result": (json.dumps({"schema": "drivetwin/result-5"}), FileRole.RESULT),
    "mapping": ('[channels.engine_torque]\nname = "M"\n', FileRole.MAPPING),
    "other json": ("{}", FileRole.OTHER),
    "damaged twin": (TWIN + "law = [1.0, 2.0,\n3.0 4.0\n", FileRole.OTHER),
    "prose": ("A drive, on a Monday; it rained.\n", FileRole.OTHER),
    "nothing": ("", FileRole.OTHER),
}


@pytest.mark.parametrize(("content", "kind"), CONTENTS.values(), ids=list(CONTENTS))
def test_content_decides(content: str, kind: FileRole, tmp_path: Path) -> None:
    for name in ("a.csv", "a.toml", "a"):
        file = tmp_path / name
        file.write_text(content, encoding="utf-8")
        assert recognise_file(file) is kind


@given(
    rows=st.lists(
        st.lists(st.floats(-1e6, 1e6, allow_nan=False), min_size=2, max_size=4),
        min_size=1,
        max_size=5,
    ),
    delimiter=st.sampled_from(",;\t"),
)
def test_tables_of_numbers_are_logs(
    rows: list[list[float]], delimiter: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    file = tmp_path_factory.mktemp("table") / "file"
    lines = [delimiter.join(("time", "torque")), *(delimiter.join(map(repr, row)) for row in rows)]
    file.write_text("\n".join(lines), encoding="utf-8")
    assert recognise_file(file) is FileRole.LOG


@given(content=st.binary(max_size=200))
def test_no_content_breaks_the_recognition(
    content: bytes, tmp_path_factory: pytest.TempPathFactory
) -> None:
    file = tmp_path_factory.mktemp("any") / "file"
    file.write_bytes(content)
    assert recognise_file(file) in FileRole


@pytest.mark.parametrize(
    ("content", "wanted", "error", "remedy"),
    [
        ("card", FileRole.TWIN, ResultFileError, "identify with this card first"),
        ("comma", FileRole.TWIN, ResultFileError, "give the twin first"),
        ("twin", FileRole.LOG, FileFormatError, "the twin comes first"),
        ("card", FileRole.LOG, FileFormatError, "--vehicle"),
        ("result", FileRole.LOG, FileFormatError, "the log that was identified"),
        ("comma", FileRole.CARD, CardError, "with --vehicle"),
        ("twin", FileRole.CARD, CardError, "need no card"),
        ("mapping", FileRole.CARD, CardError, "argument 'mapping'"),
    ],
)
def test_a_wrong_kind_is_named_with_the_remedy(
    content: str, wanted: FileRole, error: type[Exception], remedy: str, tmp_path: Path
) -> None:
    text, found = CONTENTS[content]
    file = tmp_path / "file"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(error, match=f"this is {found}, not {wanted}") as fault:
        require_kind(file, wanted)
    assert remedy in str(fault.value)
