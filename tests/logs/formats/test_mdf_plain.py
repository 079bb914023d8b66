# SPDX-License-Identifier: MIT
"""Plain MDF 4 files: read as by asammdf, and left to it in any doubt."""

from __future__ import annotations

import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import asammdf
import numpy as np
import pytest
from asammdf.blocks.conversion_utils import from_dict
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from drivetwin.channels.roles import ReadOptions, TimeColumn
from drivetwin.errors import DamagedChannelError, DrivetwinError
from drivetwin.logs.formats.mdf import open_mdf
from drivetwin.logs.formats.mdf_plain import open_plain
from drivetwin.logs.read import read_raw
from tests.fuzz.mutate import mutate
from tests.support.mdf_files import CONVERSIONS, Known, write_random_mdf

FAST = np.arange(0.0, 2.0, 0.001)
SLOW = np.arange(0.0004, 2.0, 0.02)
TYPES = ("u1", "u2", "u4", "u8", "i1", "i2", "i4", "i8", "f2", "f4", "f8")
LINEAR = {"a": 0.1, "b": -40.0}
WINDOWS: tuple[tuple[float, float] | None, ...] = (None, (0.5, 1.0), (1.9, 5.0), (3.0, 4.0))


def signal(
    name: str, time: NDArray[Any], values: NDArray[Any], unit: str = "Nm", **options: Any
) -> asammdf.Signal:
    return asammdf.Signal(values, time, name=name, unit=unit, **options)


def converted(name: str, kind: str, conversion: dict[str, Any]) -> asammdf.Signal:
    made = from_dict(conversion)
    return signal(name, FAST, make_numbers(kind, FAST.size), conversion=made)


def make_numbers(kind: str, size: int) -> NDArray[Any]:
    """Numbers (size,) over the whole range of a type, NaN and infinity among those of floats."""
    random = np.random.default_rng(int(kind[1]))
    numbers = np.frombuffer(random.bytes(size * int(kind[1])), f"<{kind}").copy()
    numbers[np.isnan(numbers)] = np.nan if kind[0] == "f" else 0  # not a signalling one
    return numbers


def save(path: Path, *groups: list[asammdf.Signal], version: str = "4.10", **options: Any) -> Path:
    with asammdf.MDF(version=version) as mdf:
        mdf.configure(write_fragment_size=1 << 12)
        for number, signals in enumerate(groups):
            mdf.append(signals, acq_name="raster", comment=f"group {number}")
        return Path(mdf.save(path, overwrite=True, **options))


def edit(path: Path, change: Callable[[bytearray], None]) -> Path:
    data = bytearray(path.read_bytes())
    change(data)
    path.write_bytes(data)
    return path


def assert_equal(found: Any, expected: Any) -> None:
    """Compare columns, warnings and all samples, in windows too."""
    assert tuple(found.columns) == tuple(expected.columns)
    assert found.warnings == expected.warnings
    for index in range(len(found.columns)):
        for window in WINDOWS:
            one, other = found.load(index, window), expected.load(index, window)
            assert (one.name, one.unit, one.group) == (other.name, other.unit, other.group)
            assert one.notes == other.notes
            assert one.values.dtype == one.time.dtype == np.float64
            np.testing.assert_array_equal(one.time, other.time, strict=True)
            np.testing.assert_array_equal(one.values, other.values, strict=True)


def compare(path: Path, options: ReadOptions | None = None) -> None:
    """Read a plain file in both ways."""
    options = options or ReadOptions()
    plain = open_plain(path, options)
    assert plain is not None
    with plain as found, open_mdf(path, options) as expected:
        assert_equal(found, expected)


@pytest.mark.parametrize("version", ["4.00", "4.10", "4.11", "4.20"])
def test_all_types_in_several_groups(tmp_path: Path, version: str) -> None:
    fast = [signal(kind, FAST, make_numbers(kind, FAST.size)) for kind in TYPES]
    slow = [signal("n", SLOW, SLOW, ""), signal("p", SLOW, 2.0 * SLOW, " bar ")]
    compare(save(tmp_path / "log.mf4", fast, slow, [signal("alone", SLOW, SLOW)], version=version))


@pytest.mark.parametrize("kind", TYPES)
def test_linear_conversions(tmp_path: Path, kind: str) -> None:
    conversions = (LINEAR, {"a": 0.1, "b": 0.0}, {"a": 1.0, "b": 3.0}, {"a": 1.0, "b": 0.0})
    signals = [converted(f"x{index}", kind, one) for index, one in enumerate(conversions)]
    compare(save(tmp_path / "log.mf4", signals))


def test_the_unit_of_a_conversion_counts_first(tmp_path: Path) -> None:
    compare(save(tmp_path / "log.mf4", [converted("x", "u2", {**LINEAR, "unit": "rpm"})]))


@pytest.mark.parametrize("unit", ["s", "ms", "deg"])
def test_stamps_as_numbers_of_a_clock(tmp_path: Path, unit: str) -> None:
    with asammdf.MDF(version="4.10") as mdf:
        mdf.append([signal("x", 1000.0 * FAST, FAST)], acq_name="g")
        mdf.groups[0].channels[0].unit = unit
        path = Path(mdf.save(tmp_path / "log.mf4", overwrite=True))
    compare(path)
    compare(path, ReadOptions(TimeColumn(unit="ms")))


def test_stamps_from_1970(tmp_path: Path) -> None:
    fast, slow = signal("x", FAST + 1.7e9, FAST), signal("y", SLOW + 1.7e9, SLOW)
    compare(save(tmp_path / "log.mf4", [slow], [fast]))


def test_a_group_without_records(tmp_path: Path) -> None:
    none = np.array([])
    compare(save(tmp_path / "log.mf4", [signal("never", none, none)], [signal("x", FAST, FAST)]))


def test_data_in_a_list_of_blocks(tmp_path: Path) -> None:
    path = tmp_path / "log.mf4"
    with asammdf.MDF(version="4.10") as mdf:
        mdf.append([signal("x", FAST, FAST), signal("y", FAST, FAST.astype("f4"))], acq_name="g")
        for start in (2.0, 4.0):
            more = ((FAST + start, None), (FAST**2, None), (FAST.astype("f4"), None))
            mdf.extend(0, list(more))
        mdf.configure(write_fragment_size=1 << 12)
        mdf.save(path, overwrite=True)
    assert path.read_bytes().count(b"##DT") > 5
    compare(path)


def test_columns_of_a_group_share_their_stamps(tmp_path: Path) -> None:
    path = save(tmp_path / "log.mf4", [signal("x", FAST, FAST), signal("y", FAST, FAST)])
    one, other = read_raw(path).channels
    assert one.time is other.time


def test_no_library_is_needed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = save(tmp_path / "log.mf4", [signal("x", FAST, FAST**2)])
    monkeypatch.setitem(sys.modules, "asammdf", None)
    assert np.array_equal(read_raw(path).channels[0].values, FAST**2)


def test_a_file_that_is_cut_while_it_is_read_is_refused(tmp_path: Path) -> None:
    path = save(tmp_path / "log.mf4", [signal("x", FAST, FAST)])
    opened = open_plain(path, ReadOptions())
    assert opened is not None
    with opened as recording:
        path.write_bytes(path.read_bytes()[:1000])
        with pytest.raises(DrivetwinError, match="cut or damaged"):
            recording.load(0)


OTHERS: dict[str, Callable[[Path], Path]] = {
    "version 3": lambda path: save(path, [signal("x", FAST, FAST)], version="3.30"),
    "compressed": lambda path: save(path, [signal("x", FAST, FAST)], compression=1),
    "table": lambda path: save(
        path, [converted("x", "u1", {"val_0": 0, "text_0": b"off", "default_addr": b"on"})]
    ),
    "formula": lambda path: save(path, [converted("x", "u1", {"formula": "X / 7"})]),
    "text": lambda path: save(
        path, [signal("x", SLOW, np.array([b"on", b"off"] * 50), encoding="utf-8")]
    ),
    "array": lambda path: save(path, [signal("x", SLOW, np.ones(SLOW.size, [("x", "<f8", (3,))]))]),
    "big endian": lambda path: save(path, [signal("x", FAST, FAST.astype(">f8"))]),
    "invalid samples": lambda path: save(
        path, [signal("x", FAST, FAST, invalidation_bits=FAST > 1.0)]
    ),
    "cut": lambda path: edit(
        save(path, [signal("x", FAST, FAST)]), lambda data: data.__delitem__(slice(-100, None))
    ),
    "unfinished": lambda path: edit(
        save(path, [signal("x", FAST, FAST)]), lambda data: struct.pack_into("<H", data, 60, 1)
    ),
    "no channel": lambda path: save(path),
}


@pytest.mark.parametrize("kind", OTHERS)
def test_other_files_are_left_to_the_library(tmp_path: Path, kind: str) -> None:
    assert open_plain(OTHERS[kind](tmp_path / "log.mf4"), ReadOptions()) is None


def replace(kind: bytes, offset: int, layout: str, *values: int) -> Callable[[bytearray], None]:
    """Write values behind the links of the first block of a kind."""

    def change(data: bytearray) -> None:
        place = data.index(kind)
        links = struct.unpack_from("<Q", data, place + 16)[0]
        struct.pack_into(layout, data, place + 24 + 8 * links + offset, *values)

    return change


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(replace(b"##DG", 0, "<B", 1), id="unsorted"),
        pytest.param(replace(b"##CG", 8, "<Q", FAST.size - 1), id="fewer records than data"),
        pytest.param(replace(b"##CG", 16, "<H", 6), id="events of a bus"),
        pytest.param(replace(b"##CN", 0, "<B", 3), id="time without samples"),
        pytest.param(replace(b"##CN", 1, "<B", 2), id="over angle"),
        pytest.param(replace(b"##CN", 3, "<B", 1), id="not at a byte"),
        pytest.param(replace(b"##CN", 8, "<I", 24), id="24 bits"),
        pytest.param(replace(b"##CN", 12, "<I", 1), id="all invalid"),
        pytest.param(replace(b"##CN", 22, "<H", 1), id="attachment"),
    ],
)
def test_blocks_that_are_not_plain(tmp_path: Path, change: Callable[[bytearray], None]) -> None:
    path = save(tmp_path / "log.mf4", [signal("x", FAST, FAST)])
    compare(path)
    assert open_plain(edit(path, change), ReadOptions()) is None


@given(seed=st.integers(0, 10**6))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_files_are_read_alike_or_left(tmp_path: Path, seed: int) -> None:
    whole = tmp_path / "whole.mf4"
    if not whole.exists():
        save(
            whole,
            [converted("x", "u2", LINEAR), signal("y", FAST, FAST)],
            [converted("z", "f4", LINEAR)],
        )
    path = tmp_path / "log.mf4"
    path.write_bytes(mutate(whole.read_bytes(), seed))
    if open_plain(path, ReadOptions()) is not None:
        compare(path)


DAILY, ALL = 12, 386


def check(recording: Any, known: dict[str, Known]) -> set[str]:
    """Compare all samples of a file; return the kinds of the channels that were right."""
    found = {column.name: index for index, column in enumerate(recording.columns)}
    assert found.keys() == known.keys()
    right = set()
    for name, truth in known.items():
        if not truth.valid.any():
            if truth.time.size:
                with pytest.raises(DamagedChannelError, match=r"left out|invalid"):
                    recording.load(found[name])
            continue
        channel = recording.load(found[name])
        np.testing.assert_allclose(channel.time, truth.time[truth.valid], rtol=1e-15)
        # Sums of three terms cancel: their rounding counts against the largest value.
        scale = np.nanmax(np.abs(truth.values), initial=1e-300)
        np.testing.assert_allclose(
            channel.values, truth.values[truth.valid], rtol=1e-12, atol=1e-14 * scale,
            err_msg=f"{name}: {truth.kind}",
        )  # fmt: skip
        right.add(truth.kind.partition(" ")[0])
    return right


def read_files(folder: Path, seeds: range) -> tuple[set[str], int]:
    """Read a file of each seed by asammdf and, if it is plain, without; count the plain ones."""
    right: set[str] = set()
    plain = 0
    for seed in seeds:
        path = folder / f"{seed}.mf4"
        known = write_random_mdf(path, seed)
        with open_mdf(path, ReadOptions()) as recording:
            right |= check(recording, known)
        if (opened := open_plain(path, ReadOptions())) is not None:
            plain += 1
            with opened as recording:
                check(recording, known)
        path.unlink()
    return right, plain


def test_known_samples_are_read(tmp_path: Path) -> None:
    right, _ = read_files(tmp_path, range(DAILY))
    assert right == set(CONVERSIONS)


@pytest.mark.exhaustive
@pytest.mark.timeout(1800)
def test_many_files_of_known_samples_are_read(tmp_path: Path) -> None:
    right, plain = read_files(tmp_path, range(DAILY, ALL))
    assert right == set(CONVERSIONS)
    assert plain
