# SPDX-License-Identifier: MIT
"""Text logs of bus tools: the frames that were sent; those of other tools are refused by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.errors import FileFormatError
from drivetwin.logs.formats.can.texts import read_bus_text
from drivetwin.logs.read import read_raw

BUSMASTER = """\
***BUSMASTER Ver 2.4.0***
***PROTOCOL CAN***
***NOTE: PLEASE DO NOT EDIT THIS DOCUMENT***
***[START LOGGING SESSION]***
***HEX***
***<Time><Tx/Rx><Channel><CAN ID><Type><DLC><DataBytes>***
11:49:12:9420 Rx 1 0x023 s 1 40
"""
CANKING = """\
Chn Identifier Flg   DLC  D0...1...2...3...4...5...6..D7       Time     Dir
 0    000000AD         8  FF  FF  00  00  00  00  00  00     154.266550 R
"""
VEHICLE_SPY = """\
Save Date,1/1/2024
Notes,
Line,Abs Time(Sec),Rel Time (Sec),Status,Er,Tx,Description,Network,Node,Arb ID,Remote,Xtd,B1,B2
2,2550.368,0.0038,67371008,F,F,HS CAN $119,HS CAN,,119,F,F,00,00
"""
FRAMES = "this is a table of raw bus frames"


@pytest.mark.parametrize(
    ("data", "name"),
    [
        (BUSMASTER, "this is a BUSMASTER log"),
        (CANKING, "this is a text log of Kvaser CanKing"),
        (VEHICLE_SPY, "this is a table of Vehicle Spy"),
        ("timestamp,arbitration_id,extended,remote,error,dlc,data\n0.1,0x123,0,0,0,1,AA==\n",
         "this is a CSV log of python-can"),
        ("1320745424.000 CXX OVMS\n1320745424.002 R11 100 01 02\n", "this is a CRTD log of OVMS"),
        ("# Logger type: CL1000\n# HW rev: 1\nTimestamp;Type;ID;Data\n01T0,0;0;1a;00\n",
         "this is a text log of a CSS logger"),
        ("t12320102\rt12320102\rt12320102\r", "raw frames in the format of slcan"),
        ("ASCII Trace IXXAT Automation GmbH\nDate: 1\n", "this is a trace of IXXAT"),
        ("Time Stamp,ID,Extended,LEN,D1,D2,D3,D4\n12,0x123,false,2,1,2,,\n", FRAMES),
        ("time,addr,bus,data\n0.1,291,0,0x0102\n", FRAMES),
        ("Time;CAN-ID (hex);DLC;Data\n0,1;123;1;00\n", FRAMES),
        ("Zeit [s]\tIdentifier\tByte 0\tByte 1\tByte 2\tByte 3\n0\t1\t0\t0\t0\t0\n", FRAMES),
    ],
)  # fmt: skip
def test_a_log_of_another_tool_is_refused_by_name(tmp_path: Path, data: str, name: str) -> None:
    path = tmp_path / "bus.log"
    path.write_text(data)
    with pytest.raises(FileFormatError, match=name) as caught:
        read_raw(path)
    assert caught.value.remedy


@pytest.mark.parametrize(
    ("head", "name"),
    [
        (b"icsbin\0\1", "a binary log of Vehicle Spy"),
        (b"SQLite format 3\0", "an SQLite file"),
        (b"\xd4\xc3\xb2\xa1\2\0\4\0", "a capture of Wireshark"),
        (b"\x0a\x0d\x0d\x0a\x1c\0\0\0", "a capture of Wireshark"),
    ],
)
def test_a_binary_log_of_another_tool_is_refused_by_name(
    tmp_path: Path, head: bytes, name: str
) -> None:
    path = tmp_path / "bus.log"
    path.write_bytes(head + bytes(200))
    with pytest.raises(FileFormatError, match=name):
        read_raw(path)


@pytest.mark.parametrize("head", [
    "time [s],ID,SpdIn [rpm]", "time [s],data,channel", "time [s],b1 [bar],b2 [bar],b3 [bar]",
    "time [s],D1,D2,D3,D4,D5",
])  # fmt: skip
def test_tables_of_signals_are_not_refused(tmp_path: Path, head: str) -> None:
    path = tmp_path / "log.csv"
    width = head.count(",")
    path.write_text(f"{head}\n" + "".join(f"{i},{','.join('1' * width)}\n" for i in range(20)))
    assert len(read_raw(path).channels) == width


ASC_HEAD = (
    "date Sat Nov 21 10:00:00.000 2026\nbase {} timestamps absolute\nno internal events logged\n"
)


def read_asc(body: str, base: str = "hex") -> Any:
    return read_bus_text((ASC_HEAD.format(base) + body).encode(), "bus.asc")


_ASC_FRAME = st.builds(
    can.Message,
    timestamp=st.integers(0, 10**9).map(lambda us: us / 1e6),
    arbitration_id=st.integers(0, 0x7FF),
    is_extended_id=st.booleans(),
    is_fd=st.booleans(),
    is_rx=st.booleans(),
    channel=st.integers(0, 3),
    data=st.sampled_from([0, 1, 2, 7, 8]).flatmap(lambda n: st.binary(min_size=n, max_size=n)),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(_ASC_FRAME, min_size=1, max_size=20))
def test_asc_frames_are_those_that_another_program_wrote(
    tmp_path: Path, sent: list[can.Message]
) -> None:
    path = tmp_path / "bus.asc"
    sent.sort(key=lambda one: one.timestamp)
    with can.ASCWriter(str(path)) as writer:
        for message in sent:
            writer.on_message_received(message)
    found = read_bus_text(path.read_bytes(), "bus.asc")
    # The writer counts from its first frame on.
    start = sent[0].timestamp if sent else 0.0
    assert found.time == pytest.approx([one.timestamp - start for one in sent], abs=2e-6)
    assert found.identifier.tolist() == [one.arbitration_id for one in sent]
    assert found.extended.tolist() == [one.is_extended_id for one in sent]
    assert found.length.tolist() == [len(one.data) for one in sent]
    payloads = [row[:n].tobytes() for row, n in zip(found.data, found.length, strict=True)]
    assert payloads == [bytes(one.data) for one in sent]
    assert [found.buses[k] for k in found.bus] == [f"channel {one.channel}" for one in sent]
    assert found.warnings == ()


def test_decimal_and_hexadecimal_tell_the_same() -> None:
    hexadecimal = read_asc("   0.010000 1  CF00203x  Rx   d 8 C5 00 19 FF FF 00 2D 03\n")
    decimal = read_asc("   0.010000 1  217055747x  Rx   d 8 197 0 25 255 255 0 45 3\n", "dec")
    assert hexadecimal.identifier.tolist() == decimal.identifier.tolist() == [0xCF00203]
    assert hexadecimal.data.tobytes() == decimal.data.tobytes()


def test_what_else_stands_in_a_line_is_passed_over() -> None:
    found = read_asc(
        "Begin Triggerblock Sat Nov 21 10:00:00.000 2026\n"
        "   0.000000 Start of measurement\n"
        "   0.010000 1  123  Rx   d 2 01 02 Length = 0 BitCount = 0 ID = 291\n"
        "   0.011000 CANFD   1 Rx  123  Engine  1 0 2 2 01 02  130000  128 0 0 0\n"
        "   0.012000 1  Statistic: D 0 R 0 XD 5 XR 0 E 0 O 0 B 0.00%\n"
        "   0.013000 1  J1939TP FEE3p 6 0 0 - Rx d 34 00 01\n"
        "   0.014000 1  123  Tx   r 8\n"
        "   0.015000 1  ErrorFrame\n"
        "End TriggerBlock\n"
    )
    assert found.length.tolist() == [2, 2]
    assert found.data[:, :2].tolist() == [[1, 2], [1, 2]]
    assert found.warnings == ("2 remote or error frames left out",)


@pytest.mark.parametrize(
    "line",
    [
        "   0.02 1  123  Rx   d 2 01",
        "   0.02 1  123  Rx   d 2 01 G2",
        "   0.0x 1  123  Rx   d 2 01 02",
        "   0.02 1  FFFFFFFF0x  Rx   d 2 01 02",
        "   0.02 1  FFF  Rx   d 2 01 02",
    ],
)
def test_a_damaged_asc_line_costs_its_frame_only(line: str) -> None:
    sound = "   0.01 1  123  Rx   d 2 01 02\n"
    found = read_asc(sound + line + "\n" + sound.replace("0.01", "0.03"))
    assert found.time.tolist() == [0.01, 0.03]
    assert found.warnings == ("1 damaged lines left out of 3",)


@pytest.mark.parametrize("line", ["-12.000001 1  123  Rx   d 2 01 02", "-0.5 1 7FF Tx d 0"])
def test_stamps_before_the_trigger(line: str) -> None:
    found = read_asc(f"{line}\n   0.010000 1  123  Rx   d 2 01 02\n")
    assert found.time.tolist() == [float(line.split()[0]), 0.01]
    assert found.warnings == ()


@given(st.data())
def test_keywords_and_digits_have_either_case(data: st.DataObject) -> None:
    body = (
        "   0.010000 1  1F000ABx  Rx   d 2 aB 02\n"
        "   0.011000 CANFD   1 Tx  12F  Engine  1 0 2 2 0c 02  130000  128 0 0 0\n"
        "   0.012000 1  ErrorFrame\n"
    )
    cases = data.draw(st.lists(st.booleans(), min_size=len(body), max_size=len(body)))
    text = "".join(c.upper() if up else c.lower() for c, up in zip(body, cases, strict=True))
    found = read_asc(text, data.draw(st.sampled_from(["hex", "HEX", "Hex"])))
    assert found.identifier.tolist() == [0x1F000AB, 0x12F]
    assert found.extended.tolist() == [True, False]
    assert found.data[:, :2].tolist() == [[0xAB, 2], [12, 2]]
    assert found.warnings == ("1 remote or error frames left out",)


def test_a_symbolic_name_has_its_number_at_the_end() -> None:
    found = read_asc(
        "   0.01 1  EngineData  Rx   d 2 01 02 Length = 0 BitCount = 0 ID = 291\n"
        "   0.02 1  EEC1  Rx   d 2 01 02 Length = 0 BitCount = 0 ID = 217056256x\n"
        "   0.03 1  Nameless  Rx   d 2 01 02\n"
    )
    assert found.identifier.tolist() == [291, 217056256]
    assert found.extended.tolist() == [False, True]
    assert found.warnings == ("1 damaged lines left out of 3",)


def test_stamps_from_event_to_event_are_added_up() -> None:
    body = (
        "   0.000000 Start of measurement\n"
        "   0.010000 1  123  Rx   d 2 01 02\n"
        "   0.005000 1  Statistic: D 0 R 0 XD 5 XR 0 E 0 O 0 B 0.00%\n"
        "   0.001000 CANFD   1 Rx  123  Engine  1 0 2 2 01 02  130000  128 0 0 0\n"
        "   0.000500 1  ErrorFrame\n"
        "   0.100000 1  123  Rx   d 2 01 02\n"
    )
    text = ASC_HEAD.format("hex").replace("absolute", "relative")
    found = read_bus_text((text + body).encode(), "bus.asc")
    assert found.time.tolist() == [0.01, 0.016, 0.1165]
    assert "time stamps from event to event added up" in found.warnings
    damaged = body.replace("0.001000", "0.001x00")
    found = read_bus_text((text + damaged).encode(), "bus.asc")
    assert "time stamps from event to event added up; after a damaged line they are early" in (
        found.warnings
    )


SPACED = b""" (000.000000)  can0  18FCF200   [8]  E1 FF FF FF FF FF FF FF
 (000.005001)  can0  18FEDF00   [3]  8A A0 28
 (000.006000)  can1       123   [0]
"""
PACKED = b"""(1436509052.249713) vcan0 044#2A366C2BBA
(1436509052.449847) vcan0 00000ABC#
"""


def test_the_form_for_people() -> None:
    frames = read_bus_text(SPACED, "log")
    assert frames.time.tolist() == [0.0, 0.005001, 0.006]
    assert frames.identifier.tolist() == [0x18FCF200, 0x18FEDF00, 0x123]
    assert frames.extended.tolist() == [True, True, False]
    assert frames.length.tolist() == [8, 3, 0]
    assert frames.data[1].tolist() == [0x8A, 0xA0, 0x28, 255, 255, 255, 255, 255]
    assert [frames.buses[place] for place in frames.bus] == ["can0", "can0", "can1"]
    assert frames.warnings == ()


def test_the_packed_form_is_relative_to_its_first_frame() -> None:
    frames = read_bus_text(PACKED, "log")
    assert frames.time == pytest.approx([0.0, 0.200134], abs=1e-6)
    assert frames.identifier.tolist() == [0x44, 0xABC]
    assert frames.extended.tolist() == [False, True]
    assert frames.data[0, :5].tobytes() == bytes.fromhex("2A366C2BBA")


def test_lines_that_are_no_data_frame_are_counted() -> None:
    data = SPACED + (
        b" (000.007000)  can0  123   [0]  remote request\n"
        b"(0.008000) can0 123#R\n"
        b" (000.010000)  can0  18FEDF00   [8]  8A A0\n garbage\n"
    )
    frames = read_bus_text(data, "log")
    assert frames.time.size == 3
    assert frames.warnings == (
        "2 remote or error frames left out",
        "2 damaged lines left out of 7",
    )


def test_frames_marked_as_errors_are_no_damage() -> None:
    """The forms of `candump -ta -a -e -x` and of `candump -L`."""
    data = SPACED + (
        b" (000.007000)  can0  RX - -  1A0   [2]  01 02   '..'\n"
        b" (000.008000)  can0  RX - -  20000004   [8]  00 00 00 00 00 00 00 00   ERRORFRAME\n"
        b"\tcontroller-problem{}\n"
        b" (000.009000)  can0  1A0   [0]  remote request\n"
        b"(0.010000) can0 20000080#0000000000000000\n"
    )
    frames = read_bus_text(data, "log")
    assert frames.identifier[3:].tolist() == [0x1A0]
    assert frames.warnings == ("3 remote or error frames left out",)


def test_frames_that_another_queue_overtook_are_sorted() -> None:
    """Every fifth frame is stamped 2 ms early: too many steps back for a clock that is set."""
    stamps = np.round(1.7e9 + 1e-3 * np.arange(500) - 2e-3 * (np.arange(500) % 5 == 4), 6)
    data = "".join(f"({one:.6f}) can0 100#{k % 256:02X}\n" for k, one in enumerate(stamps))
    frames = read_bus_text(data.encode(), "log")
    assert frames.time.size == 500
    assert np.all(np.diff(frames.time) >= 0.0)
    assert frames.data[:, 0].tolist() == (np.argsort(stamps, kind="stable") % 256).tolist()
    assert "100 frames out of order by up to 1 ms sorted by their stamps" in frames.warnings


def test_frames_of_can_fd_are_longer() -> None:
    long = bytes(range(24))
    data = (
        b"(0.001000) can0 123##1" + long.hex().encode() + b"\n"
        b" (000.002000)  can0  124  [24]  " + long.hex(" ").encode() + b"\n"
        b"(0.003000) can0 125#0102\n"
    )
    frames = read_bus_text(data, "log")
    assert frames.warnings == ()
    assert frames.length.tolist() == [24, 24, 2]
    assert frames.data[0].tobytes() == frames.data[1].tobytes() == long
    assert frames.data[2, :4].tolist() == [1, 2, 255, 255]


def test_dates_are_stamps() -> None:
    lines = [
        f" (2026-11-21 {clock})  can0  123   [1]  0{k}"
        for k, clock in enumerate(("23:59:59.900000", "23:59:60.100000", "99:59:59.000000"))
    ]
    frames = read_bus_text(("\n".join(lines) + "\n").encode(), "log")
    assert frames.time == pytest.approx([0.0, 0.2], abs=1e-6)
    shift = "time counts from the first stamp, 1795305599.9 s"
    assert frames.warnings == ("1 damaged lines left out of 3", shift)


@pytest.mark.parametrize(
    ("form", "reason"),
    [
        (" ({:.6f})  can0  0CF00203   [2]  00 01\n", "count from frame to frame"),
        ("  can0  0CF00203   [2]  00 01\n", "no time stamps"),
    ],
)
def test_stamps_of_no_clock_are_refused(form: str, reason: str) -> None:
    steps = np.random.default_rng(3).uniform(1e-4, 2e-3, 300)
    data = "".join(form.format(step) for step in steps).encode()
    with pytest.raises(FileFormatError, match=reason) as caught:
        read_bus_text(data, "log")
    assert "candump -L" in caught.value.remedy


CANDUMP_FRAMES = st.lists(
    st.tuples(
        st.integers(0, 10**9),
        st.booleans(),
        st.integers(0, (1 << 29) - 1),
        st.binary(max_size=8),
        st.sampled_from(["can0", "vcan1"]),
    ),
    min_size=1,
    max_size=30,
)


@given(CANDUMP_FRAMES, st.booleans())
def test_round_trip(sent: list[tuple[int, bool, int, bytes, str]], packed: bool) -> None:
    sent.sort(key=lambda one: one[0])
    lines = []
    for micro, extended, number, data, bus in sent:
        name = f"{number:08X}" if extended else f"{number & 0x7FF:03X}"
        stamp = f"({micro / 1e6:.6f})"
        if packed:
            lines.append(f"{stamp} {bus} {name}#{data.hex()}")
        else:
            lines.append(f" {stamp}  {bus}  {name:>8}   [{len(data)}]  {data.hex(' ')}")
    frames = read_bus_text(("\n".join(lines) + "\n").encode(), "log")
    assert frames.warnings == ()
    for row, (micro, extended, number, data, bus) in enumerate(sent):
        assert frames.time[row] == pytest.approx(micro / 1e6, abs=1e-9)
        assert frames.extended[row] == extended
        assert frames.identifier[row] == (number if extended else number & 0x7FF)
        assert frames.data[row, : frames.length[row]].tobytes() == data
        assert frames.buses[frames.bus[row]] == bus


GVRET_HEAD = b"Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\n"
GVRET_OLD = b"Time Stamp,ID,Extended,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\r\n"

GVRET_FRAME = st.tuples(
    st.integers(0, 10**12), st.integers(0, 0x7FF), st.booleans(), st.integers(0, 3),
    st.binary(max_size=8),
)  # fmt: skip


@given(st.lists(GVRET_FRAME, min_size=1, max_size=20), st.booleans())
def test_written_frames_read_back_equal(
    frames: list[tuple[int, int, bool, int, bytes]], new: bool
) -> None:
    frames.sort(key=lambda one: one[0])
    lines = []
    for time, identifier, extended, bus, payload in frames:
        way = "Rx," if new else ""
        cells = "".join(f"{byte:02X}," for byte in payload)
        flag = str(extended).lower()
        lines.append(f"{time},{identifier:08X},{flag},{way}{bus},{len(payload)},{cells}")
    found = read_bus_text((GVRET_HEAD if new else GVRET_OLD) + "\n".join(lines).encode(), "x")
    start = frames[0][0] if frames[0][0] > 1e12 else 0
    assert found.identifier.tolist() == [one[1] for one in frames]
    assert found.extended.tolist() == [one[2] for one in frames]
    assert found.length.tolist() == [len(one[4]) for one in frames]
    assert [bytes(row[:n]) for row, n in zip(found.data, found.length.tolist(), strict=True)] == [
        one[4] for one in frames
    ]
    assert [found.buses[bus] for bus in found.bus] == [f"channel {one[3]}" for one in frames]
    assert found.time[1:] - found.time[0] == pytest.approx(
        [1e-6 * (one[0] - frames[0][0]) for one in frames[1:]], abs=1e-6 + 1e-9 * start
    )


def test_damaged_lines_are_counted() -> None:
    data = (
        GVRET_HEAD + b"1,123,false,Rx,0,1,00,\n2,123,false,Rx,0,3,00,\n3,80000000,true,Rx,0,0,\nx\n"
    )
    found = read_bus_text(data, "x")
    assert found.length.tolist() == [1]
    assert found.warnings == ("3 damaged lines left out of 4",)


def test_a_head_alone_is_refused() -> None:
    with pytest.raises(FileFormatError, match="no frame"):
        read_bus_text(GVRET_HEAD, "x")
