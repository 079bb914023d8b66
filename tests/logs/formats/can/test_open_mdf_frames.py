# SPDX-License-Identifier: MIT
"""Raw bus frames in MDF 4 files: the same signals as from a log of the bus itself."""

from __future__ import annotations

from pathlib import Path

import asammdf
import numpy as np
import pytest
from numpy.typing import NDArray

from drivetwin.channels.roles import BusOptions, ReadOptions
from drivetwin.errors import MissingChannelError
from drivetwin.logs.read import read_log, read_raw
from tests.fuzz.seeds import candump, frames
from tests.logs.fixtures import card

Sent = list[tuple[float, int, bytes]]
PARTS = ["BusChannel", "ID", "IDE", "DLC", "DataLength", "DataBytes"]


def records(sent: Sent, width: int = 8) -> NDArray[np.void]:
    """Frames as a logger stores them: one structure each."""
    kinds = ["<u1", "<u4", "<u1", "<u1", "<u1", f"({width},)u1"]
    table = np.zeros(
        len(sent), [(f"CAN_DataFrame.{n}", k) for n, k in zip(PARTS, kinds, strict=True)]
    )
    for row, (_, identifier, data) in enumerate(sent):
        payload = np.frombuffer(data.ljust(width, b"\0"), np.uint8)
        code = len(data) if len(data) <= 8 else 13
        table[row] = (1, identifier, 1, code, len(data), payload)
    return table


def write(path: Path, groups: list[Sent], width: int = 8, *, signals: bool = False) -> Path:
    with asammdf.MDF(version="4.10") as mdf:
        for sent in groups:
            time = np.array([one[0] for one in sent])
            mdf.append(
                [
                    asammdf.Signal(
                        samples=records(sent, width), timestamps=time, name="CAN_DataFrame"
                    )
                ]
            )
        if signals:
            time = np.linspace(0.0, 1.0, 50)
            mdf.append([asammdf.Signal(samples=time, timestamps=time, name="T_Oil", unit="degC")])
        mdf.save(path, overwrite=True)
    return path


def test_the_same_log_as_from_the_bus(tmp_path: Path) -> None:
    text = tmp_path / "bus.log"
    text.write_bytes(candump(spaced=True))
    expected = read_log(text, card(tmp_path))
    found = read_log(write(tmp_path / "bus.mf4", [frames()]), card(tmp_path))
    assert found.channels.keys() == expected.channels.keys()
    for role, channel in expected.channels.items():
        assert np.array_equal(found[role].values, channel.values)
        assert found[role].time == pytest.approx(channel.time, abs=1e-6)
    assert found.findings == expected.findings


def test_groups_of_one_bus_are_put_in_order(tmp_path: Path) -> None:
    whole = read_raw(write(tmp_path / "whole.mf4", [frames()]))
    parts = read_raw(write(tmp_path / "parts.mf4", [frames()[::2], frames()[1::2]]))
    assert parts.columns == whole.columns
    for one, other in zip(parts.channels, whole.channels, strict=True):
        assert np.array_equal(one.values, other.values)


DBC = """VERSION ""
BU_: A
BO_ 2147483939 Speeds: 32 A
 SG_ n_ab : 232|16@1+ (0.25,0) [0|0] "rpm" A
"""


def test_frames_beside_signals_need_a_database(tmp_path: Path) -> None:
    sent = [
        (0.01 * k, 0x123, bytes(29) + (400 + k).to_bytes(2, "little") + b"\0") for k in range(20)
    ]
    log = write(tmp_path / "both.mf4", [sent], 64, signals=True)
    plain = read_raw(log)
    assert [one.name for one in plain.channels] == ["T_Oil"]
    assert "raw bus frames are not decoded" in plain.warnings[0]
    (tmp_path / "bus.dbc").write_text(DBC)
    both = read_raw(log, ReadOptions(bus=BusOptions((tmp_path / "bus.dbc",))))
    assert [one.name for one in both.channels] == ["T_Oil", "n_ab"]
    assert both.channels[1].values == pytest.approx(100.0 + 0.25 * np.arange(20))
    assert both.channels[0].values == pytest.approx(plain.channels[0].values)


def test_an_unknown_bus_asks_for_its_database(tmp_path: Path) -> None:
    log = write(tmp_path / "bus.mf4", [[(0.01 * k, 0x18FFFF23, b"\1\2") for k in range(20)]])
    with pytest.raises(MissingChannelError, match="none of the 1 identifiers"):
        read_raw(log)


def test_no_frame_and_no_signal(tmp_path: Path) -> None:
    with pytest.raises(MissingChannelError, match="no channel with a time base"):
        read_raw(write(tmp_path / "bus.mf4", [[]]))


def test_frames_without_a_stamp_are_counted(tmp_path: Path) -> None:
    sent = [(np.inf if k == 3 else one[0], one[1], one[2]) for k, one in enumerate(frames())]
    raw = read_raw(write(tmp_path / "bus.mf4", [sent]))
    assert "1 frames without a time stamp left out" in raw.warnings
    assert all(np.isfinite(one.time).all() for one in raw.channels)


def test_frames_from_1970_count_from_the_first_of_the_file(tmp_path: Path) -> None:
    expected = read_log(write(tmp_path / "bus.mf4", [frames()]), card(tmp_path))
    late = [(1.7e9 + time, identifier, data) for time, identifier, data in frames()]
    found = read_log(write(tmp_path / "late.mf4", [late[::2], late[1::2]]), card(tmp_path))
    start = min(time for time, _, _ in frames())
    for role, channel in expected.channels.items():
        assert found[role].time == pytest.approx(channel.time - start, abs=2e-6)
    assert "time counts from the first stamp" in found.findings[0].text


def test_an_attached_database_is_used(tmp_path: Path) -> None:
    path = write(tmp_path / "bus.mf4", [[(0.01 * k, 0x123, bytes(32)) for k in range(20)]], 32)
    with asammdf.MDF(path) as mdf:
        mdf.attach(DBC.encode(), file_name="car.dbc", mime="application/x-dbc")
        mdf.attach(b"BO_ damaged", file_name="notes.txt", mime="text/plain")
        path = Path(mdf.save(tmp_path / "attached.mf4", overwrite=True))
    raw = read_raw(path)
    assert [(one.name, one.unit, one.time.size) for one in raw.channels] == [("n_ab", "rpm", 20)]
    assert "frames decoded by the attached database car.dbc" in raw.warnings
