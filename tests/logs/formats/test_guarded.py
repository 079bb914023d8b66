# SPDX-License-Identifier: MIT
"""Files on which a library crashes, hangs or takes all memory end as typed errors."""

from __future__ import annotations

import re
import struct
import subprocess
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from drivetwin.channels.roles import ReadOptions
from drivetwin.errors import DamagedChannelError, FileFormatError, ReaderFailureError
from drivetwin.logs.formats import guarded
from drivetwin.logs.read import read_log, read_raw
from tests.fuzz.seeds import SEEDS
from tests.logs.formats.hostile_readers import NAMES, HostileRecording, open_hostile, open_never


@pytest.fixture(autouse=True)
def _guarded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guarded, "_guards_parsers", True)


@pytest.fixture
def recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """A recording in a child that may take 64 MiB."""
    monkeypatch.setattr(guarded, "BASE_MEMORY", 2**26)
    with guarded.open_guarded(open_hostile, tmp_path / "log.bin", ReadOptions()) as opened:
        yield opened


ENDED = "crashes on the file|cannot be read"
"""A process that divides by zero ends on some machines and raises on others."""


@pytest.fixture
def crashing(tmp_path: Path) -> Path:
    """A sound compressed variable of numbers of no known type: SciPy ends the process."""
    time = np.linspace(0.0, 1.0, 20)
    path = tmp_path / "crashing.mat"
    savemat(path, {"x": time, "x_t": time}, do_compression=False)
    whole = path.read_bytes()
    size = 8 + struct.unpack_from("<I", whole, 132)[0]
    variable = bytearray(whole[128 : 128 + size])
    variable[48] = 77  # 9: double
    packed = zlib.compress(variable)
    element = struct.pack("<II", 15, len(packed)) + packed
    path.write_bytes(whole[:128] + element + whole[128 + size :])
    return path


def load(recording: Any, name: str) -> None:
    recording.load(NAMES.index(name))


def test_columns_come_as_the_reader_gives_them(recording: Any) -> None:
    here = HostileRecording()
    assert recording.columns == here.columns
    assert list(recording.warnings) == ["one warning"]
    for window in (None, (0.25, 0.75), (2.0, 3.0)):
        found, expected = recording.load(0, window), here.load(0, window)
        np.testing.assert_array_equal(found.time, expected.time)
        np.testing.assert_array_equal(found.values, expected.values)
        assert (found.name, found.unit, found.group, found.notes) == (
            expected.name,
            expected.unit,
            expected.group,
            expected.notes,
        )
        assert found.values.flags.writeable
    assert list(recording.warnings) == ["one warning", "another"]


def test_errors_of_a_column_come_back_as_they_were_and_others_are_read_on(
    recording: Any,
) -> None:
    with pytest.raises(DamagedChannelError) as caught:
        load(recording, "damaged")
    assert (caught.value.what, caught.value.remedy) == ("no numbers", "map another")
    assert (caught.value.where.channel, caught.value.where.time) == ("damaged", 0.5)
    with pytest.raises(RuntimeError, match="ZeroDivisionError"):
        load(recording, "faulty")
    load(recording, "sound")


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux")
def test_a_column_that_takes_too_much_memory_is_refused(recording: Any) -> None:
    with pytest.raises(ReaderFailureError, match=r"more than 0\.1 GiB of memory") as caught:
        load(recording, "greedy")
    assert caught.value.where.file is not None
    assert caught.value.where.file.endswith("log.bin")
    assert caught.value.remedy
    load(recording, "sound")


def test_a_reader_that_ends_is_a_typed_error_with_its_last_word(recording: Any) -> None:
    for name in ("dies", "sound"):
        with pytest.raises(ReaderFailureError, match="code 7: a last word"):
            load(recording, name)


@pytest.mark.parametrize("opener", [open_hostile, open_never])
def test_a_reader_that_hangs_is_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, opener: Any
) -> None:
    monkeypatch.setattr(guarded, "BASE_TIME", 3.0)
    with (
        pytest.raises(ReaderFailureError, match="not read after 3 s"),
        guarded.open_guarded(opener, tmp_path / "log.bin", ReadOptions()) as recording,
    ):
        load(recording, "hangs")


def test_a_file_that_crashes_the_library_is_a_typed_error(crashing: Path) -> None:
    for read in (read_raw, lambda path: read_log(path, None)):
        with pytest.raises(FileFormatError, match=ENDED) as caught:
            read(crashing)
        assert caught.value.where.file == str(crashing)
        assert "export the log again" in caught.value.remedy


def test_the_program_survives_a_file_that_crashes_the_library(crashing: Path) -> None:
    command = [sys.executable, "-m", "drivetwin", "inspect", str(crashing)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=100, check=False)
    assert done.returncode == 2
    assert re.search(ENDED, done.stderr)
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("name", ["mf4"])
def test_a_sound_file_is_read_as_without_the_guard(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    path = tmp_path / "sound.log"
    path.write_bytes(SEEDS[name](tmp_path))
    found = read_raw(path)
    monkeypatch.setattr(guarded, "_guards_parsers", False)
    expected = read_raw(path)
    assert found.warnings == expected.warnings
    assert found.unreadable == expected.unreadable
    assert len(found.channels) == len(expected.channels)
    for one, other in zip(found.channels, expected.channels, strict=True):
        assert (one.name, one.unit, one.group, one.notes) == (
            other.name,
            other.unit,
            other.group,
            other.notes,
        )
        np.testing.assert_array_equal(one.time, other.time)
        np.testing.assert_array_equal(one.values, other.values)


def test_text_is_read_in_this_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subprocess, "Popen", None)
    path = tmp_path / "log.csv"
    path.write_text("time [s],x\n0,1\n1,2\n2,3\n")
    assert read_raw(path).channels
