# SPDX-License-Identifier: MIT
"""Opening a bus log of any form with its databases."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from drivetwin.channels.read_options import ReadOptions
from drivetwin.logs.formats.can.asc import is_asc, read_asc
from drivetwin.logs.formats.can.blf import read_blf
from drivetwin.logs.formats.can.candump import is_candump, read_candump
from drivetwin.logs.formats.can.database import Message, read_database
from drivetwin.logs.formats.can.driveline import load_driveline_messages
from drivetwin.logs.formats.can.recording import BusRecording
from drivetwin.logs.formats.frames import Frames
from drivetwin.logs.raw import Recording


def is_bus_text(head: bytes) -> bool:
    """Return True if the first bytes of a file are a bus log in text form."""
    return is_candump(head) or is_asc(head)


@contextmanager
def open_bus_text(path: Path, options: ReadOptions) -> Iterator[Recording]:
    """Open a candump or ASC log; raises FileFormatError, MissingExtraError, MissingChannelError."""
    data = path.read_bytes()
    read = read_candump if is_candump(data[:8192]) else read_asc
    frames = read(data, str(path))
    yield decode_recording(frames, options, path)


@contextmanager
def open_blf(path: Path, options: ReadOptions) -> Iterator[Recording]:
    """Open a BLF log; raises FileFormatError, MissingExtraError, MissingChannelError."""
    yield decode_recording(read_blf(path), options, path)


def decode_recording(frames: Frames, options: ReadOptions, path: Path) -> BusRecording:
    """Decode frames by the databases stated; raises MissingChannelError, MissingExtraError."""
    return BusRecording(frames, _select_messages(options.bus.databases), options.bus, path)


def _select_messages(databases: tuple[Path, ...]) -> tuple[Message, ...]:
    """Messages of the stated databases, else the built-in ones of J1939."""
    return read_database(databases) if databases else load_driveline_messages()
