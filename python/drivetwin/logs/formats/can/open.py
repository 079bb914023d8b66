# SPDX-License-Identifier: MIT
"""Opening a bus log of any form with its databases."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from drivetwin.channels.read_options import ReadOptions
from drivetwin.logs.formats.can.asc import is_asc, read_asc
from drivetwin.logs.formats.can.blf import read_blf
from drivetwin.logs.formats.can.candump import is_candump, read_candump
from drivetwin.logs.formats.can.database import load_driveline_messages, read_database
from drivetwin.logs.formats.can.gvret import is_gvret, read_gvret
from drivetwin.logs.formats.can.recording import BusRecording
from drivetwin.logs.formats.can.trc import is_trc, read_trc
from drivetwin.logs.formats.frames import Frames
from drivetwin.logs.formats.j1939.matching import match_groups
from drivetwin.logs.raw import LogFormat, Recording

_HEAD = 8192
"""Number of bytes used to detect a format."""

_TEXT_FORMATS: tuple[tuple[Callable[[bytes], bool], Callable[[bytes, str], Frames]], ...] = (
    (is_trc, read_trc),
    (is_gvret, read_gvret),
    (is_candump, read_candump),
    (is_asc, read_asc),
)
"""Test of the first bytes, and reader, of each bus log in text form."""


def is_bus_text(head: bytes) -> bool:
    """Return True if the first bytes of a file are a bus log in text form."""
    return any(fits(head) for fits, _ in _TEXT_FORMATS)


@contextmanager
def open_bus_text(path: Path, options: ReadOptions) -> Iterator[Recording]:
    """Open a bus log in text form.

    Raises FileFormatError, MissingExtraError, MissingChannelError.
    """
    data = path.read_bytes()
    read = next(read for fits, read in _TEXT_FORMATS if fits(data[:_HEAD]))
    yield decode_recording(read(data, str(path)), options, path)


@contextmanager
def open_blf(path: Path, options: ReadOptions) -> Iterator[Recording]:
    """Open a BLF log; raises FileFormatError, MissingExtraError, MissingChannelError."""
    yield decode_recording(read_blf(path), options, path)


BLF_FORMAT = LogFormat(open_blf, (".blf",), (b"LOGG",), guarded=True)
BUS_TEXT_FORMAT = LogFormat(open_bus_text, (".asc", ".trc", ".log"), recognises=is_bus_text)


def decode_recording(frames: Frames, options: ReadOptions, path: Path) -> BusRecording:
    """Decode frames by the databases stated; raises MissingChannelError, MissingExtraError."""
    stated = (
        read_database(options.bus.databases) if options.bus.databases else load_driveline_messages()
    )
    messages, notes = match_groups(frames, stated, load_driveline_messages)
    frames = replace(frames, warnings=(*frames.warnings, *notes))
    return BusRecording(frames, messages, options.bus, path)
