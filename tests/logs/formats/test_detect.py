# SPDX-License-Identifier: MIT
"""Contract of readers: each registered format, and each of its forms, passes the same checks.

A form is a sound file of `tests.fuzz.seeds`, the list that the fuzzer damages at random.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from drivetwin.errors import DrivetwinError, FileFormatError, MissingExtraError
from drivetwin.logs.formats.detect import FORMATS, open_recording
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.read import read_raw
from tests.fuzz.seeds import SEEDS, channels
from tests.support.repeats import mark_repeats


@dataclass(frozen=True)
class Reader:
    """Form of a format, with its exceptions from the contract.

    `library` is the module without which it cannot be read, `extra` installs it. `rounding` is that
    of its numbers, over their largest. A form that `keeps` is read up to a cut. `note` is in the
    only warning of its sound file.
    """

    opener: str
    library: str | None = None
    extra: str = ""
    bus: bool = False
    rounding: float = 0.0
    keeps: bool = False
    note: str | None = None


_TEXT = Reader("can.open.open_bus_text", bus=True, keeps=True)
_MAT = Reader("mat.open_mat")
READERS = {
    "csv": Reader("csv.open_csv", keeps=True),
    "csv-long": Reader("csv.open_csv", rounding=5e-6, keeps=True, note="one row for each"),
    "csv-pairs": Reader("csv.open_csv", rounding=5e-6, keeps=True, note="several time columns"),
    "mf4": Reader("mdf.open_mdf", "asammdf", "mdf"),
    "mdf3": Reader("mdf.open_mdf", "asammdf", "mdf"),
    "mf4-bus": Reader("mdf.open_mdf", "asammdf", "mdf", bus=True),
    "mat": _MAT,
    "mat4": _MAT,
    "mat5": _MAT,
    "mat73": Reader("mat.open_mat", "pymatreader", "io"),
    "parquet": Reader("parquet.open_parquet", "pyarrow.parquet", "io"),
    "parquet_arrow": Reader("parquet.open_arrow", "pyarrow.ipc", "io"),
    "blf": Reader("can.open.open_blf", "can", "can", bus=True, keeps=True),
    "candump": _TEXT,
    "candump-L": Reader(_TEXT.opener, bus=True, keeps=True, note="counts from the first stamp"),
    "gvret": _TEXT,
    "asc": _TEXT,
    "asc-relative": Reader(_TEXT.opener, bus=True, keeps=True, note="event to event added up"),
    "trc": _TEXT,
}
MOST_LOST = 0.01
"""Share of a file that has no complete row or frame."""
HEAD, LINE = 72, 24
"""Bytes by which a format is recognised, with the first block of MDF; less than a line of text."""
STAMPS = 2e-6
"""Rounding of the stamps of a bus [s]: microseconds, and the start of the measurement."""


def make(name: str, folder: Path) -> Path:
    """The sound file, under an ending of no format."""
    path = folder / "log.any"
    path.write_bytes(SEEDS[name](folder))
    return path


def expect(name: str, folder: Path) -> tuple[RawChannel, ...]:
    """Channels that were written; those of a bus as another form has them."""
    if not READERS[name].bus:
        return tuple(channels())
    other = "candump" if name != "candump" else "asc"
    return read_raw(make(other, folder)).channels


def read_or_refuse(path: Path) -> tuple[RawChannel, ...] | DrivetwinError:
    try:
        return read_raw(path).channels
    except DrivetwinError as fault:
        return fault


def test_each_format_has_a_form_and_each_form_a_seed() -> None:
    assert {one.opener for one in FORMATS} == {one.opener for one in READERS.values()}
    assert READERS.keys() == SEEDS.keys()


@pytest.mark.parametrize("name", READERS)
def test_names_units_stamps_and_numbers_are_those_that_were_written(
    tmp_path: Path, name: str
) -> None:
    reader = READERS[name]
    expected = {one.name: one for one in expect(name, tmp_path)}
    raw = read_raw(make(name, tmp_path))
    assert reader.bus or raw.unreadable == {}
    assert len(raw.warnings) == (reader.note is not None)
    assert (reader.note or "") in "".join(raw.warnings)
    assert {one.name: one.unit for one in raw.channels} == {
        one.name: one.unit for one in expected.values()
    }
    for one in raw.channels:
        other = expected[one.name]
        exact = STAMPS if reader.bus else 0.0
        np.testing.assert_allclose(one.time - one.time[0], other.time - other.time[0], 0.0, exact)
        bound = reader.rounding * float(np.max(np.abs(other.values)))
        np.testing.assert_allclose(one.values, other.values, 0.0, bound)


@pytest.mark.parametrize("name", READERS)
def test_a_window_has_the_samples_inside_it(tmp_path: Path, name: str) -> None:
    with open_recording(make(name, tmp_path)) as recording:
        read = {one.name for one in expect(name, tmp_path)}
        for index in (k for k, one in enumerate(recording.columns) if one.name in read):
            whole, part = recording.load(index), recording.load(index, (0.5, 1.0))
            inside = (whole.time >= 0.5) & (whole.time <= 1.0)
            np.testing.assert_array_equal(part.time, whole.time[inside])
            np.testing.assert_array_equal(part.values, whole.values[inside])


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("share", mark_repeats([0.0, 1e-3, 0.03, 0.5, 0.999], [0.5]))
def test_a_cut_file_is_a_typed_error_or_is_read_up_to_the_cut(
    tmp_path: Path, name: str, share: float
) -> None:
    reader = READERS[name]
    expected = {one.name: one.values for one in expect(name, tmp_path)}
    path = make(name, tmp_path)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    found = read_or_refuse(path)
    if isinstance(found, DrivetwinError):
        assert found.remedy
        assert found.where.file == str(path)
        return
    assert reader.keeps
    assert share >= MOST_LOST
    for one in found:
        values = expected[one.name]
        assert one.values.size <= values.size
        bound = reader.rounding * float(np.max(np.abs(values)))
        before = slice(one.values.size - 1)  # the number at the cut may have lost digits
        np.testing.assert_allclose(one.values[before], values[before], 0.0, bound)


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize(
    "filling", mark_repeats([b"\0", b"\xff", b"\n", b'"', b"9", "ä\u2028".encode()], [b"9"])
)
def test_hostile_content_behind_a_sound_head_is_a_typed_error(
    tmp_path: Path, name: str, filling: bytes
) -> None:
    path = make(name, tmp_path)
    head = path.read_bytes()[: LINE if READERS[name].keeps else HEAD]
    path.write_bytes(head + (5000 // len(filling)) * filling)
    with pytest.raises(DrivetwinError) as caught:
        read_raw(path)
    assert caught.value.remedy


@pytest.mark.parametrize("name", [name for name, one in READERS.items() if one.library])
def test_without_its_library_the_install_command_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    path = make(name, tmp_path)
    monkeypatch.setitem(sys.modules, str(READERS[name].library), None)
    with pytest.raises(MissingExtraError) as caught:
        read_raw(path)
    assert caught.value.remedy == f'pip install "drivetwin[{READERS[name].extra}]"'


@pytest.mark.parametrize("name", [name for name, one in READERS.items() if not one.library])
def test_other_forms_need_no_optional_library(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    path = make(name, tmp_path)
    for one in READERS.values():
        if one.library:
            monkeypatch.setitem(sys.modules, one.library, None)
    assert read_raw(path).channels


@pytest.mark.parametrize("share", [0.5, 0.99])
def test_a_blf_file_shorter_than_its_head_states_is_named(tmp_path: Path, share: float) -> None:
    path = make("blf", tmp_path)
    whole = path.read_bytes()
    size = int(share * len(whole))
    path.write_bytes(whole[:size])
    assert any(
        re.search(f"{size} of the {len(whole)} bytes", one) for one in read_raw(path).warnings
    )


@pytest.mark.parametrize(
    ("head", "name"),
    [
        (b"\x89HDF\r\n\x1a\n", "an HDF5 file without MATLAB header"),
        (b"\x1f\x8b\x08", "a gzip archive"),
    ],
)
def test_a_format_without_a_reader_is_refused_by_name(
    tmp_path: Path, head: bytes, name: str
) -> None:
    path = tmp_path / "log"
    path.write_bytes(head)
    with pytest.raises(FileFormatError, match=f"this is {name}") as caught:
        open_recording(path)
    assert "BLF" in caught.value.remedy
