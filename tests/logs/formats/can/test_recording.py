# SPDX-License-Identifier: MIT
"""Bus logs as columns: J1939 by the built-in messages, other buses by a DBC."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from drivetwin.channels.roles import BusOptions, ReadOptions
from drivetwin.errors import DamagedChannelError, MissingChannelError
from drivetwin.logs.raw import RawChannel, RawLog
from drivetwin.logs.read import read_log, read_raw
from tests.fuzz.seeds import candump
from tests.logs.fixtures import card


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "bus.log"
    path.write_bytes(candump(spaced=True))
    return path


def by_name(path: Path, options: ReadOptions | None = None) -> dict[str, RawChannel]:
    return {channel.name: channel for channel in read_raw(path, options).channels}


def test_percent_torque_becomes_torque(log: Path) -> None:
    found = by_name(log)
    assert found["ActualEngPercentTorque"].unit == "%"
    actual = found["ActualEngTorque"]
    assert actual.unit == "Nm"
    assert actual.values == pytest.approx(np.full(200, 1500.0))
    assert actual.notes == ("reference torque 2000 N·m from EC1 from 0x00",)
    friction = found["NominalFrictionTorque"]
    assert friction.values == pytest.approx(np.full(200, 200.0))
    net = found["EngNetTorque"]
    assert net.values == pytest.approx(np.full(net.values.size, 1300.0))
    assert "1 samples without friction torque left out" in net.notes
    assert net.time.tolist() == actual.time[1:].tolist()  # before the first friction: unknown


def test_the_reference_torque_can_be_asserted(log: Path) -> None:
    asserted = by_name(log, ReadOptions(bus=BusOptions(reference_torque=1000.0)))
    assert asserted["ActualEngTorque"].values == pytest.approx(np.full(200, 750.0))


def test_without_reference_torque_percent_stays(log: Path) -> None:
    lines = [line for line in log.read_bytes().splitlines() if b"1CE" not in line]
    log.write_bytes(b"\n".join(lines) + b"\n")
    raw = read_raw(log)
    assert not any(one.name.endswith("Torque") and one.unit == "Nm" for one in raw.channels)
    assert "reference_torque_Nm" in raw.warnings[0]


def test_codes_that_are_no_value_are_left_out_and_told(log: Path) -> None:
    lines = log.read_bytes().splitlines()
    speeds = [index for index, line in enumerate(lines) if b"0CF00203" in line]
    for index, code in zip(speeds[10:14], (0xFFFF, 0xFE00, 0xFEFF, 0xFB00), strict=True):
        part = struct.pack("<H", code).hex(" ").upper().encode()
        lines[index] = lines[index][:-8] + part + lines[index][-3:]
    log.write_bytes(b"\n".join(lines) + b"\n")
    channel = by_name(log)["TransInputShaftSpeed"]
    assert channel.time.size == 196
    assert channel.notes == (
        "1 not available, 2 marked as error, 1 outside the valid range of 200 samples left out",
    )
    assert channel.values.max() < 1600.0


def test_what_a_sender_never_fills_is_no_candidate(log: Path) -> None:
    raw = read_raw(log)
    assert "PercentClutchSlip" not in by_name(log)
    (reason,) = (text for name, text in raw.unreadable.items() if "PercentClutchSlip" in name)
    assert "200 not available of 200" in reason


def test_roles_are_recognised(log: Path, tmp_path: Path) -> None:
    found = read_log(log, card(tmp_path))
    assert {role: one.source_name for role, one in found.channels.items()} == {
        "engine_torque": "EngNetTorque",
        "input_speed": "TransInputShaftSpeed",
        "engine_speed": "EngSpeed",
        "output_speed": "TransOutputShaftSpeed",
        "shift_in_process": "TransShiftInProcess",
        "lockup_engaged": "TransTorqueConverterLockupEngaged",
    }


def test_senders_and_buses_are_told_apart(log: Path) -> None:
    data = log.read_bytes()
    other = data.replace(b"0CF00400", b"0CF00401").replace(b"can0", b"can1")
    log.write_bytes(data + other)
    groups = [one.group for one in read_raw(log).channels if one.name == "EngSpeed"]
    assert groups == ["EEC1 from 0x00 on can0", "EEC1 from 0x01 on can1"]


DBC = """VERSION ""
BU_: A
BO_ 291 Speeds: 4 A
 SG_ n_in : 0|16@1+ (0.25,0) [0|0] "rpm" A
 SG_ n_ab : 16|16@1+ (0.25,0) [0|0] "rpm" A
"""


def test_another_bus_by_its_dbc(tmp_path: Path) -> None:
    (tmp_path / "bus.dbc").write_text(DBC)
    log = tmp_path / "bus.log"
    rows = [struct.pack("<HH", 4000 + k, 2000 + k).hex() for k in range(20)]
    log.write_text("".join(f"({0.01 * k:.6f}) can0 123#{row}\n" for k, row in enumerate(rows)))
    with pytest.raises(MissingChannelError, match="none of the 1 identifiers") as caught:
        read_raw(log)
    stated = 'bus = { dbc = ["bus.dbc"] }'
    assert stated in caught.value.remedy
    (tmp_path / "channels.toml").write_text(stated)
    assert "input_speed" in read_log(log, None, needed=())
    found = by_name(log, ReadOptions(bus=BusOptions((tmp_path / "bus.dbc",))))
    assert found["n_in"].values == pytest.approx(1000.0 + 0.25 * np.arange(20))
    assert (found["n_ab"].unit, found["n_ab"].group) == ("rpm", "Speeds")


PLAIN = """VERSION ""

BU_: A

BO_ 291 M: 2 A
 SG_ speed : 0|8@1+ (1,0) [0|0] "rpm" A
"""
SWITCHED = """VERSION ""

BU_: A

BO_ 291 M: 2 A
 SG_ switch M : 0|8@1+ (1,0) [0|0] "" A
 SG_ part0 m0 : 8|8@1+ (1,0) [0|0] "rpm" A
 SG_ part1 m1 : 8|8@1+ (1,0) [0|0] "rpm" A
"""


def record(
    folder: Path, stamps: Sequence[float], payloads: Sequence[bytes], dbc: str = PLAIN
) -> RawLog:
    """Read frames of one message that is not J1939."""
    (folder / "bus.dbc").write_text(dbc)
    rows = zip(stamps, payloads, strict=True)
    lines = [f"({at:.6f}) can0 123#{payload.hex()}\n" for at, payload in rows]
    (folder / "bus.log").write_text("".join(lines))
    return read_raw(folder / "bus.log", ReadOptions(bus=BusOptions((folder / "bus.dbc",))))


@pytest.mark.parametrize("step", [0.01, 0.0101], ids=["sorted", "left out"])
def test_frames_that_others_overtook_are_sorted_up_to_20_ms(tmp_path: Path, step: float) -> None:
    """The frames 10 and 11 come behind frame 12."""
    order = [*range(10), 12, 10, 11, *range(13, 20)]
    raw = record(tmp_path, [step * k for k in order], [bytes([k]) for k in order])
    (channel,) = raw.channels
    assert np.all(np.diff(channel.time) > 0.0)
    if step == 0.01:
        assert channel.values.tolist() == list(range(20))
        assert "2 frames out of order by up to 20 ms sorted by their stamps" in raw.warnings
    else:
        assert channel.values.tolist() == [*range(10), *range(11, 20)]
        assert channel.notes == ("1 frames with an earlier stamp left out",)


def test_repeated_stamps_are_left_out_and_counted_for_each_signal(tmp_path: Path) -> None:
    stamps = np.round(0.007 * np.arange(20), 2)
    (channel,) = record(tmp_path, stamps.tolist(), [bytes([k]) for k in range(20)]).channels
    count = 20 - np.unique(stamps).size
    assert channel.notes == (f"{count} repeated frames left out",)
    assert channel.values.size == np.unique(stamps).size


def test_frames_of_a_multiplexer_with_one_stamp_are_no_repeats(tmp_path: Path) -> None:
    stamps = np.repeat(0.01 * np.arange(15), 2).tolist()
    payloads = [bytes([code, k]) for k in range(15) for code in (0, 1)]
    raw = record(tmp_path, stamps, payloads, SWITCHED)
    for name in ("part0", "part1"):
        (channel,) = raw.get_channels(name)
        assert channel.values.tolist() == list(range(15))
        assert channel.notes == ()


def test_short_frames_are_left_out_and_counted(tmp_path: Path) -> None:
    payloads = [bytes([0, k]) if k % 5 else bytes([0]) for k in range(20)]
    raw = record(tmp_path, [0.01 * k for k in range(20)], payloads, SWITCHED)
    (channel,) = raw.get_channels("part0")
    assert channel.notes == ("4 frames too short for the signal left out",)
    assert channel.values.size == 16


@pytest.mark.parametrize("first", [0.0, 1e4], ids=["clock set back", "one stamp far ahead"])
def test_a_clock_that_runs_back_for_long_refuses_the_signal(tmp_path: Path, first: float) -> None:
    stamps = [first or 5.0, *(0.01 * k for k in range(1, 300))]
    raw = record(tmp_path, stamps, [bytes([k % 200]) for k in range(300)])
    (reason,) = raw.unreadable.values()
    assert "299 of 300 frames have an earlier stamp" in reason


def test_the_fault_of_a_signal_reaches_the_user(tmp_path: Path) -> None:
    """A clock that was set refuses the only candidate of a role; another sensor takes its place."""
    (tmp_path / "bus.dbc").write_text(DBC)
    (tmp_path / "channels.toml").write_text('bus = { dbc = ["bus.dbc"] }')
    log = tmp_path / "bus.log"
    stamps = [*(0.01 * np.arange(100)), *(0.01 * np.arange(100))]
    rows = [struct.pack("<HH", 4000 + k, 2000 + k).hex() for k in range(200)]
    lines = [f"({at:.6f}) can0 123#{row}" for at, row in zip(stamps, rows, strict=True)]
    log.write_text("\n".join(lines) + "\n")
    with pytest.raises(DamagedChannelError, match="99 of 200 frames have an earlier stamp"):
        read_log(log, None)
    other = DBC.replace("291 Speeds", "292 Turbine")
    (tmp_path / "bus.dbc").write_text(DBC + other.partition("BU_: A\n")[2])
    sound = [f"({0.01 * k:.6f}) can0 124#{row}" for k, row in enumerate(rows)]
    log.write_text("\n".join([*lines, *sound]) + "\n")
    assert read_log(log, None, sound=())["input_speed"].values.size == 200
