# SPDX-License-Identifier: MIT
"""Reader of Vector's binary bus logs, BLF, by python-can."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin._util.optional_dependencies import handle_parser_errors, import_extra
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.errors import FileFormatError
from drivetwin.logs.formats.frames import LONGEST, FrameRow, Frames, collect_frames

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
    frames: list[FrameRow] = []
    left_out = 0
    warnings: list[str] = []
    try:
        with handle_parser_errors(kind, path):
            left_out = _collect_frames(reader, frames)
    except FileFormatError as fault:
        if not frames:
            raise
        warnings.append(f"{fault.what}; {len(frames)} frames were read before")
    stamps = _count_from_start([row[0] for row in frames], reader.start_timestamp).tolist()
    rows = [(stamp, *row[1:]) for stamp, row in zip(stamps, frames, strict=True)]
    total = len(rows) + left_out
    return collect_frames(rows, str(path), lines=total, other=left_out, notes=tuple(warnings))


def _collect_frames(reader: Iterable[Any], frames: list[FrameRow]) -> int:
    """Append the data frames; return how many others there were."""
    left_out = 0
    for message in reader:
        data = bytes(message.data)
        if message.is_remote_frame or message.is_error_frame or len(data) > LONGEST:
            left_out += 1
            continue
        frames.append(
            (message.timestamp, message.arbitration_id, message.is_extended_id, data,
             f"channel {message.channel}")
        )  # fmt: skip
    return left_out


def _count_from_start(stamps: Sequence[float], start: float) -> FloatArray:
    """Return the time [s] from the start of the measurement, negative before its trigger.

    The file counts in 64 bits without a sign: a negative time arrives as a very late one.
    """
    time = np.array(stamps, np.float64) - start
    return np.where(time > 0.5 * _RANGE, time - _RANGE, time)
