# SPDX-License-Identifier: MIT
"""Traces of PEAK-System's tools: the frames that another program wrote, damage costs its line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import can
import pytest
from can.io.trc import TRCFileVersion
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.errors import FileFormatError
from drivetwin.logs.formats.can.texts import read_bus_text

VERSION_1_0 = """\
;##########################################################################
;   C:\\TraceFile.trc
;
;    CAN activities imported from C:\\TraceFile.trc
;    Start time: 11.09.2002 16:04:27.624
;##########################################################################
     1)      -18  0001  8  00 00 00 00 00 00 00 00
     2)       18  18FEF100 2  01 02
     3)       20  FFFFFFFF  4  00 00 00 08 -- -- -- --
     4)       21  0002  4  RTR
"""
VERSION_1_1 = """\
;$FILEVERSION=1.1
;$STARTTIME=37704.6587229167
;##########################################################################
;   Message Number
;---+--   ----+----  --+--  ----+---  +  -+ -- -- -- -- -- -- --
     1)        -1.8  Rx         0001  8  00 00 00 00 00 00 00 00
     2)        18.0  Rx     18FEF100  2  01 02
     3)        20.9  Warng  FFFFFFFF  4  00 00 00 08  BUSHEAVY
     4)        22.9  Tx         0300  0
     5)        23.9  Error      0008  4  00 19 08 08
     6)        24.9  Rx         0300  3  RTR
"""
VERSION_1_2 = """\
;$FILEVERSION=1.2
;$STARTTIME=39878.6772258947
     1)         1.059 1  Rx     00000300 2  00 00
     2)         1.283 2  Tx         0400 0
"""
VERSION_1_3 = """\
;$FILEVERSION=1.3
;$STARTTIME=39878.6772258947
     1)         1.059 1  Rx     00000300 -  2    00 00
     2)         1.283 2  Tx         0400 -  0
     3)         1.284 2  Rx         0400 -  3    RTR
"""
VERSION_2_0 = """\
;$FILEVERSION=2.0
;$STARTTIME=42209.4075997106
;$COLUMNS=N,O,T,I,d,l,D
      1      -1.059 DT     0300 Rx 7  00 00 00 00 04 00 00
      2       1.283 FB 18EBFF00 Rx 12 00 01 02 03 04 05 06 07 08 09 0A 0B
      3       2.575 RR     0200 Rx 5
      4       2.575 EC          Rx 5  02 02 00 00
      5       2.616 ST          Rx    00 00 00 04
"""
VERSION_2_1 = """\
;$FILEVERSION=2.1
;$STARTTIME=43008.920986006946
;$COLUMNS=N,O,T,B,I,d,R,L,D
      1       1.059 DT 1      0300 Rx -  2    01 02
      2       1.283 FD 2  18EBFF00 Tx -  9    00 01 02 03 04 05 06 07 08 09 0A 0B
      3       2.575 ST 1         - Rx -  4    00 00 00 08
      4       2.666 DT 1      0300 Rx -  0
"""


def read_trc(text: str) -> Any:
    return read_bus_text(text.encode(), "bus.trc")


@pytest.mark.parametrize(
    ("text", "stamps", "identifiers", "lengths", "other"),
    [
        (VERSION_1_0, [-18.0, 18.0], [1, 0x18FEF100], [8, 2], 2),
        (VERSION_1_1, [-1.8, 18.0, 22.9], [1, 0x18FEF100, 0x300], [8, 2, 0], 3),
        (VERSION_1_2, [1.059, 1.283], [0x300, 0x400], [2, 0], 0),
        (VERSION_1_3, [1.059, 1.283], [0x300, 0x400], [2, 0], 1),
        (VERSION_2_0, [-1.059, 1.283], [0x300, 0x18EBFF00], [7, 12], 3),
        (VERSION_2_1, [1.059, 1.283, 2.666], [0x300, 0x18EBFF00, 0x300], [2, 12, 0], 1),
    ],
)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_each_version(
    text: str,
    stamps: list[float],
    identifiers: list[int],
    lengths: list[int],
    other: int,
    end: str,
) -> None:
    found = read_trc(text.replace("\n", end))
    assert found.time * 1e3 == pytest.approx(stamps)
    assert found.identifier.tolist() == identifiers
    assert found.length.tolist() == lengths
    assert found.warnings == ((f"{other} remote or error frames left out",) if other else ())


def test_a_mark_of_utf8_and_commas_in_stamps() -> None:
    found = read_trc("\ufeff" + VERSION_1_1.replace(".0 ", ",0 ").replace(".8 ", ",8 "))
    assert found.time * 1e3 == pytest.approx([-1.8, 18.0, 22.9])
    assert found.warnings == ("3 remote or error frames left out",)


def test_bus_and_kind_of_identifier() -> None:
    found = read_trc(VERSION_1_2)
    assert [found.buses[k] for k in found.bus] == ["channel 0", "channel 1"]
    assert found.extended.tolist() == [True, False]


_TRC_FRAME = st.builds(
    can.Message,
    timestamp=st.integers(0, 10**9).map(lambda us: us / 1e6),
    arbitration_id=st.integers(0, 0x7FF),
    is_extended_id=st.booleans(),
    is_rx=st.booleans(),
    channel=st.integers(1, 4),
    data=st.sampled_from([0, 1, 2, 7, 8]).flatmap(lambda n: st.binary(min_size=n, max_size=n)),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(_TRC_FRAME, min_size=1, max_size=20),
    st.sampled_from([TRCFileVersion.V1_0, TRCFileVersion.V2_1]),
)
def test_trc_frames_are_those_that_another_program_wrote(
    tmp_path: Path, sent: list[can.Message], version: TRCFileVersion
) -> None:
    path = tmp_path / "bus.trc"
    sent.sort(key=lambda one: one.timestamp)
    with can.TRCWriter(str(path)) as writer:
        writer.file_version = version
        for message in sent:
            writer.on_message_received(message)
    found = read_bus_text(path.read_bytes(), "bus.trc")
    start = sent[0].timestamp
    exact = 2e-6 if version is TRCFileVersion.V2_1 else 1.1e-3
    assert found.time == pytest.approx([one.timestamp - start for one in sent], abs=exact)
    assert found.identifier.tolist() == [one.arbitration_id for one in sent]
    assert found.extended.tolist() == [one.is_extended_id for one in sent]
    payloads = [row[:n].tobytes() for row, n in zip(found.data, found.length, strict=True)]
    assert payloads == [bytes(one.data) for one in sent]


@pytest.mark.parametrize(
    "line",
    [
        "      9       2.7 DT 1      0300 Rx -  2    01",
        "      9       2.7 DT 1      0300 Rx -  2    01 G2",
        "      9       2.x DT 1      0300 Rx -  2    01 02",
        "      9       2.7 DT 1      0900 Rx -  2    01 02",
        "      9       2.7 DT",
    ],
)
def test_a_damaged_trc_line_costs_its_frame_only(line: str) -> None:
    found = read_trc(VERSION_2_1 + line + "\n")
    assert found.time.size == 3
    assert found.warnings[1:] == ("1 damaged lines left out of 5",)


@pytest.mark.parametrize("columns", ["N,O,T,B,d,R,L,D", "N,O,O,T,I,D", "D,N,O,T,I,L"])
def test_columns_without_frames(columns: str) -> None:
    with pytest.raises(FileFormatError, match="do not hold time, type, identifier and data"):
        read_trc(VERSION_2_1.replace("N,O,T,B,I,d,R,L,D", columns))
