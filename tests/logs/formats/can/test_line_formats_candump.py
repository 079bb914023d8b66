# SPDX-License-Identifier: MIT
"""Both text forms of candump."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import FileFormatError
from drivetwin.logs.formats.can.texts import is_bus_text, read_bus_text

SPACED = b""" (000.000000)  can0  18FCF200   [8]  E1 FF FF FF FF FF FF FF
 (000.005001)  can0  18FEDF00   [3]  8A A0 28
 (000.006000)  can1       123   [0]
"""
PACKED = b"""(1436509052.249713) vcan0 044#2A366C2BBA
(1436509052.449847) vcan0 00000ABC#
"""


def test_the_form_for_people() -> None:
    assert is_bus_text(SPACED)
    frames = read_bus_text(SPACED, "log")
    assert frames.time.tolist() == [0.0, 0.005001, 0.006]
    assert frames.identifier.tolist() == [0x18FCF200, 0x18FEDF00, 0x123]
    assert frames.extended.tolist() == [True, True, False]
    assert frames.length.tolist() == [8, 3, 0]
    assert frames.data[1].tolist() == [0x8A, 0xA0, 0x28, 255, 255, 255, 255, 255]
    assert [frames.buses[place] for place in frames.bus] == ["can0", "can0", "can1"]
    assert frames.warnings == ()


def test_the_packed_form_is_relative_to_its_first_frame() -> None:
    assert is_bus_text(PACKED)
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
    assert is_bus_text(data)
    frames = read_bus_text(data, "log")
    assert frames.warnings == ()
    assert frames.length.tolist() == [24, 24, 2]
    assert frames.data[0].tobytes() == frames.data[1].tobytes() == long
    assert frames.data[2, :4].tolist() == [1, 2, 255, 255]


@pytest.mark.parametrize("head", [b"", b"time,n\ns,rpm\n0,1\n", b"(hello) can0\n"])
def test_other_texts_are_no_candump(head: bytes) -> None:
    assert not is_bus_text(head)


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
    assert is_bus_text(data)
    with pytest.raises(FileFormatError, match=reason) as caught:
        read_bus_text(data, "log")
    assert "candump -L" in caught.value.remedy


FRAMES = st.lists(
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


@given(FRAMES, st.booleans())
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
