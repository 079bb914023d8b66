# SPDX-License-Identifier: MIT
"""Opening a bus log of any form with its databases."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin._util.optional_dependencies import handle_parser_errors, import_extra
from drivetwin.channels.roles import ReadOptions
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.formats.can.database import (
    load_driveline_messages,
    parse_database,
    read_database,
)
from drivetwin.logs.formats.can.recording import BusRecording
from drivetwin.logs.formats.can.texts import read_bus_text
from drivetwin.logs.formats.frames import LONGEST, Frames, build_frames, describe_left_out
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


_RANGE = 2.0**64 * 1e-9
"""Time [s] after which 64 bits of nanoseconds start again."""


def read_blf(path: Path) -> Frames:
    """Read the data frames of a BLF file; raises MissingExtraError, FileFormatError."""
    kind = "a BLF bus log"
    can = import_extra("can", "can", kind, path)
    with path.open("rb") as file, handle_parser_errors(kind, path):
        return _read_frames(can.BLFReader(file), kind, path)


def _read_frames(reader: Any, kind: str, path: Path) -> Frames:
    """The table of data frames; what breaks off is read up to there."""
    messages: list[Any] = []
    size = path.stat().st_size
    cut = f"the file is cut: {size} of the {reader.file_size} bytes that its head states"
    broken: tuple[str, ...] = (cut,) if size < reader.file_size else ()
    try:
        with handle_parser_errors(kind, path):
            messages.extend(reader)
    except FileFormatError as fault:
        if not messages:
            raise
        broken += (f"{fault.what}; {len(messages)} frames were read before",)
    frames = [one for one in messages if _is_data(one)]
    if not frames:
        raise FileFormatError("no frame can be read", "record it again", Where(file=str(path)))
    stamps = [one.timestamp for one in frames]
    return build_frames(
        _count_from_start(stamps, reader.start_timestamp).tolist(),
        [one.arbitration_id for one in frames],
        [one.is_extended_id for one in frames],
        [bytes(one.data) for one in frames],
        [f"channel {one.channel}" for one in frames],
        (*describe_left_out(len(messages), len(messages) - len(frames), len(frames)), *broken),
    )


def _is_data(message: Any) -> bool:
    is_other = message.is_remote_frame or message.is_error_frame
    return not is_other and len(message.data) <= LONGEST


def _count_from_start(stamps: Sequence[float], start: float) -> FloatArray:
    """Return the time [s] from the start of the measurement, negative before its trigger.

    The file counts in 64 bits without a sign: a negative time arrives as a very late one.
    """
    time = np.array(stamps, np.float64) - start
    return np.where(time > 0.5 * _RANGE, time - _RANGE, time)
