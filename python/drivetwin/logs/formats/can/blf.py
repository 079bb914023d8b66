# SPDX-License-Identifier: MIT
"""Reader of Vector's binary bus logs, BLF, by python-can."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from drivetwin._util.optional_dependencies import foreign_parser, require
from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.formats.frames import LONGEST, Frames, frame_table


def read_blf(path: Path) -> Frames:
    """Read the data frames of a BLF file; raises MissingExtraError, FileFormatError."""
    kind = "a BLF bus log"
    can = require("can", "can", kind, path)
    with path.open("rb") as file, foreign_parser(kind, path):
        return _read(can.BLFReader(file), kind, path)


def _read(reader: Any, kind: str, path: Path) -> Frames:
    """The table of data frames; what breaks off is read up to there."""
    frames: list[tuple[float, int, bool, bytes, str]] = []
    left_out = 0
    warnings: list[str] = []
    try:
        with foreign_parser(kind, path):
            left_out = _collect(reader, frames)
    except FileFormatError as fault:
        if not frames:
            raise
        warnings.append(f"{fault.what}; {len(frames)} frames were read before")
    if not frames:
        raise FileFormatError("no frame in the file", "record it again", Where(file=str(path)))
    if left_out:
        warnings.append(f"{left_out} remote or error frames left out")
    stamps, identifiers, extended, payloads, buses = zip(*frames, strict=True)
    return frame_table(stamps, identifiers, extended, payloads, buses, tuple(warnings))


def _collect(reader: Iterable[Any], frames: list[tuple[float, int, bool, bytes, str]]) -> int:
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
