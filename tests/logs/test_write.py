# SPDX-License-Identifier: MIT
"""One log in every format reads back as the same log."""

from __future__ import annotations

import errno
from pathlib import Path

import numpy as np
import pytest

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel
from drivetwin.errors import FileFormatError, TimeError, UnitError
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.read import read_log, read_raw
from drivetwin.logs.write import convert_to_recorded_units, write_log
from drivetwin.vehicle.card import load_card
from tests.logs.fixtures import card, columns, write
from tests.support.repeats import mark_repeats

ROOT = Path(__file__).resolve().parents[2]
SHARED = ROOT.parent / "shared"
SUFFIXES = [".csv", ".mf4", ".mat", ".parquet"]


def channels() -> list[RawChannel]:
    """Three time bases that share some stamps, one channel with a missing number."""
    stamps = np.array([0.0004 + 0.02 * k for k in range(-25, 75)])
    slow = RawChannel("te", "Nm", stamps, np.linspace(100.0, 900.0, 100))
    time = np.array([0.01 * k for k in range(200)])
    fast = RawChannel("n_in", "1/min", time, 1500.0 + np.sin(time))
    speed = RawChannel("n_ab", "U/min", time, np.where(time == 0.5, np.nan, 800.0 + time))
    plain = RawChannel("x", None, time[::3], time[::3] / 3.0)
    return [slow, fast, speed, plain]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_columns_return_bit_by_bit(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"log{suffix}"
    write_log(path, channels())
    read = {channel.name: channel for channel in read_raw(path).channels}
    assert set(read) == {"te", "n_in", "n_ab", "x"}
    for sent in channels():
        got = read[sent.name]
        assert got.unit == sent.unit
        assert np.array_equal(got.time, sent.time)
        assert np.array_equal(got.values, sent.values, equal_nan=True)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_shift_log_is_the_same_in_every_format(tmp_path: Path, suffix: str) -> None:
    first = read_log(write(tmp_path, columns()), card(tmp_path))
    path = tmp_path / f"again{suffix}"
    write_log(path, [convert_to_recorded_units(channel) for channel in first.channels.values()])
    again = read_log(path, card(tmp_path))
    assert set(again.channels) == set(first.channels)
    for role, channel in first.channels.items():
        assert np.array_equal(again[role].time, channel.time)
        assert again[role].values == pytest.approx(channel.values, rel=1e-14)
        assert again[role].held == channel.held
    assert again.findings == first.findings


@pytest.mark.parametrize("suffix", [*SUFFIXES, ".MAT"])
def test_a_log_appears_whole_or_not_at_all(
    tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"log{suffix}"
    write_log(path, channels())
    assert list(tmp_path.iterdir()) == [path]
    whole = path.read_bytes()
    monkeypatch.setattr("os.fsync", _full_disk)
    with pytest.raises(OSError, match="No space left"):
        write_log(str(path), channels()[:1])
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == whole


def _full_disk(_: int) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_channel_in_a_unit_that_is_unknown_is_not_written_in_another() -> None:
    time = np.array([0.0, 1.0])
    channel = Channel("output_speed", Quantity.SPEED, time, time, "SpdOut", "furlong")
    with pytest.raises(UnitError, match="channel 'SpdOut': unknown unit 'furlong'"):
        convert_to_recorded_units(channel)


@pytest.mark.parametrize("suffix", mark_repeats(SUFFIXES, SUFFIXES[:2]))
def test_a_recorded_log_is_the_same_in_every_format(tmp_path: Path, suffix: str) -> None:
    source = SHARED / "logs" / "truck_b.mf4"
    if not source.exists():
        pytest.skip("the shared logs are not beside the repository")
    vehicle = load_card(ROOT / "examples" / "vehicles" / "truck_b.toml")
    first = read_log(source, vehicle)
    path = tmp_path / f"again{suffix}"
    write_log(path, [convert_to_recorded_units(channel) for channel in first.channels.values()])
    again = read_log(path, vehicle)
    for role, channel in first.channels.items():
        assert np.array_equal(again[role].time, channel.time)
        assert again[role].values == pytest.approx(channel.values, rel=1e-14, abs=1e-9)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_time_that_does_not_increase_is_refused(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"log{suffix}"
    for stamps in ([0.0, 1.0, 0.5, 2.0], [0.0, 1.0, 1.0, 2.0], [0.0, 1.0, np.nan, 2.0]):
        twice = RawChannel("te", "Nm", np.array(stamps), np.arange(4.0))
        with pytest.raises(TimeError) as caught:
            write_log(path, [twice])
        assert caught.value.where.channel == "te"
    assert not path.exists()


def test_what_a_format_cannot_hold_is_refused(tmp_path: Path) -> None:
    one = channels()[0]
    with pytest.raises(FileFormatError, match=r"no format has the ending '\.xls'"):
        write_log(tmp_path / "log.xls", [one])
    with pytest.raises(FileFormatError, match="names repeat"):
        write_log(tmp_path / "log.csv", [one, one])
    odd = RawChannel("n ab", "rpm", one.time, one.values)
    with pytest.raises(FileFormatError, match="'n ab' is no variable name in MATLAB"):
        write_log(tmp_path / "log.mat", [odd])
    named_as_time = RawChannel(f"{one.name}_t", "Nm", one.time, one.values)
    for pair in ([one, named_as_time], [named_as_time, one]):
        with pytest.raises(FileFormatError, match=f"'{one.name}_t' would be a channel, and time"):
            write_log(tmp_path / "log.mat", pair)
