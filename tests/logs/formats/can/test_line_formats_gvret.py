# SPDX-License-Identifier: MIT
"""Tables of SavvyCAN: every frame, damage costs its line only."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import FileFormatError
from drivetwin.logs.formats.can.texts import is_bus_text, read_bus_text

HEAD = b"Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\n"
OLD = b"Time Stamp,ID,Extended,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\r\n"

FRAME = st.tuples(
    st.integers(0, 10**12), st.integers(0, 0x7FF), st.booleans(), st.integers(0, 3),
    st.binary(max_size=8),
)  # fmt: skip


@given(st.lists(FRAME, min_size=1, max_size=20), st.booleans())
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
    found = read_bus_text((HEAD if new else OLD) + "\n".join(lines).encode(), "x")
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
    data = HEAD + b"1,123,false,Rx,0,1,00,\n2,123,false,Rx,0,3,00,\n3,80000000,true,Rx,0,0,\nx\n"
    found = read_bus_text(data, "x")
    assert found.length.tolist() == [1]
    assert found.warnings == ("3 damaged lines left out of 4",)


def test_a_head_alone_is_refused() -> None:
    assert is_bus_text(HEAD)
    with pytest.raises(FileFormatError, match="no frame"):
        read_bus_text(HEAD, "x")
