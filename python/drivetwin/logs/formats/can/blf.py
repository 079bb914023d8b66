# SPDX-License-Identifier: MIT
"""Reader of Vector's binary bus logs, BLF, by python-can."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin._util.optional_dependencies import handle_parser_errors, import_extra
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.formats.frames import LONGEST, Frames, build_frames, describe_left_out

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
