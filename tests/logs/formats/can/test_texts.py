# SPDX-License-Identifier: MIT
"""Native logs of bus tools without a reader are refused by name; tables of signals are not."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.errors import FileFormatError
from drivetwin.logs.formats.detect import open_recording

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
        open_recording(path)
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
        open_recording(path)


@pytest.mark.parametrize("head", [
    "time [s],ID,SpdIn [rpm]", "time [s],data,channel", "time [s],b1 [bar],b2 [bar],b3 [bar]",
    "time [s],D1,D2,D3,D4,D5",
])  # fmt: skip
def test_tables_of_signals_are_not_refused(tmp_path: Path, head: str) -> None:
    path = tmp_path / "log.csv"
    width = head.count(",")
    path.write_text(f"{head}\n" + "".join(f"{i},{','.join('1' * width)}\n" for i in range(20)))
    with open_recording(path) as recording:
        assert len(recording.columns) == width
