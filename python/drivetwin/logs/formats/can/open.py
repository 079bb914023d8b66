# SPDX-License-Identifier: MIT
"""Opening a bus log of any form with its databases."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from drivetwin.channels.read_options import ReadOptions
from drivetwin.logs.formats.can.blf import read_blf
from drivetwin.logs.formats.can.database import (
    load_driveline_messages,
    parse_database,
    read_database,
)
from drivetwin.logs.formats.can.recording import BusRecording
from drivetwin.logs.formats.can.texts import read_bus_text
from drivetwin.logs.formats.frames import Frames
from drivetwin.logs.formats.j1939.matching import match_groups
from drivetwin.logs.raw import Recording


@contextmanager
def open_bus_text(path: Path, options: ReadOptions) -> Iterator[Recording]:
    """Open a bus log in text format.

    Raises FileFormatError, MissingExtraError, MissingChannelError.
    """
    yield decode_recording(read_bus_text(path.read_bytes(), str(path)), options, path)


@contextmanager
def open_blf(path: Path, options: ReadOptions) -> Iterator[Recording]:
    """Open a BLF log; raises FileFormatError, MissingExtraError, MissingChannelError."""
    yield decode_recording(read_blf(path), options, path)


def decode_recording(
    frames: Frames, options: ReadOptions, path: Path, attached: Mapping[str, bytes] | None = None
) -> BusRecording:
    """Decode frames by the databases stated, else those `attached` to the log, else the built-in.

    `attached` are the contents by name. Raises FileFormatError, MissingChannelError,
    MissingExtraError.
    """
    notes: tuple[str, ...] = ()
    if options.bus.databases:
        stated = read_database(options.bus.databases)
    elif attached:
        parsed = (
            parse_database(data, path.with_name(f"{path.name} (attached {name})"))
            for name, data in attached.items()
        )
        stated = tuple(message for one in parsed for message in one)
        notes = (f"frames decoded by the attached database {', '.join(attached)}",)
    else:
        stated = load_driveline_messages()
    messages, matched = match_groups(frames, stated, load_driveline_messages)
    frames = replace(frames, warnings=(*frames.warnings, *notes, *matched))
    return BusRecording(frames, messages, options.bus, path)
