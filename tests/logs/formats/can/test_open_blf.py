# SPDX-License-Identifier: MIT
"""BLF by python-can: other frames counted, damage typed, the library optional."""

from __future__ import annotations

import struct
from pathlib import Path

import can
import pytest

from drivetwin.logs.formats.can.open import read_blf


def test_frames_without_signals_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "bus.blf"
    with can.BLFWriter(str(path)) as writer:
        for number in range(4):
            writer.on_message_received(
                can.Message(
                    timestamp=1.0 + number,
                    arbitration_id=0x123,
                    is_extended_id=False,
                    is_remote_frame=number == 2,
                    data=b"" if number == 2 else b"\1\2",
                    channel=0,
                )
            )
    frames = read_blf(path)
    assert frames.time.size == 3
    assert frames.identifier.tolist() == [0x123] * 3
    assert frames.warnings == ("1 remote or error frames left out",)


class SignedStamps:
    """Header of an object whose stamp is 12 s earlier, before the start of the measurement."""

    layout = struct.Struct("<LHHq")
    size = layout.size

    def pack(self, flags: int, index: int, version: int, stamp: int) -> bytes:
        return self.layout.pack(flags, index, version, stamp - 12 * 10**9)


def test_frames_before_the_trigger(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "bus.blf"
    monkeypatch.setattr("can.io.blf.OBJ_HEADER_V1_STRUCT", SignedStamps())
    with can.BLFWriter(str(path)) as writer:
        for stamp in (0.0, 11.5, 12.25):
            writer.on_message_received(
                can.Message(timestamp=1.7e9 + stamp, arbitration_id=0x123, data=b"\1", channel=0)
            )
    monkeypatch.undo()
    assert read_blf(path).time == pytest.approx([-12.0, -0.5, 0.25], abs=5e-6)


def test_frames_of_can_fd_are_longer(tmp_path: Path) -> None:
    path = tmp_path / "bus.blf"
    with can.BLFWriter(str(path)) as writer:
        for number, data in enumerate((bytes(range(32)), b"\1\2")):
            writer.on_message_received(
                can.Message(
                    timestamp=1.0 + number,
                    arbitration_id=0x123,
                    is_extended_id=False,
                    is_fd=len(data) > 8,
                    data=data,
                    channel=0,
                )
            )
    frames = read_blf(path)
    assert frames.length.tolist() == [32, 2]
    assert frames.data[0].tobytes() == bytes(range(32))
    assert frames.warnings == ()
