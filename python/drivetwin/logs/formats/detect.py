# SPDX-License-Identifier: MIT
"""Detection of the file format from the first bytes; the file name is not used."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path

from drivetwin._util.regular_file import measure_regular_file
from drivetwin.channels.read_options import ReadOptions
from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.formats.arrow import ARROW_FORMAT
from drivetwin.logs.formats.can.open import BLF_FORMAT, BUS_TEXT_FORMAT
from drivetwin.logs.formats.can.other_tools import refuse_bus_tool
from drivetwin.logs.formats.csv import CSV_FORMAT
from drivetwin.logs.formats.guarded import open_guarded
from drivetwin.logs.formats.mat import MAT_FORMAT
from drivetwin.logs.formats.mdf import MDF_FORMAT
from drivetwin.logs.formats.parquet import PARQUET_FORMAT
from drivetwin.logs.raw import LogFormat, Recording

FORMATS: tuple[LogFormat, ...] = (
    MDF_FORMAT,
    MAT_FORMAT,
    PARQUET_FORMAT,
    ARROW_FORMAT,
    BLF_FORMAT,
    BUS_TEXT_FORMAT,
    CSV_FORMAT,
)
"""Formats in the order in which they are tried; a file that none of them recognises is CSV."""

SUFFIXES = frozenset(ending for one in FORMATS for ending in one.endings)
"""Endings by which a folder's logs are known; a file that is named by itself may have any."""

_HEAD = 8192
"""Number of bytes used to detect a format."""

_REFUSED = {
    b"\x89HDF": "an HDF5 file without MATLAB header",
    b"PK\x03\x04": "a zip archive or Excel workbook",
    b"\x1f\x8b": "a gzip archive",
}
"""First bytes of unsupported formats that an error names instead of `binary`."""


def is_binary_log(head: bytes) -> bool:
    """Return whether the first bytes of a file are those of a binary log format."""
    return any(head.startswith(one.starts) for one in FORMATS if one.starts)


def open_recording(
    path: Path, options: ReadOptions | None = None
) -> AbstractContextManager[Recording]:
    """Open a log of any format for reading its columns one by one.

    Libraries for binary formats run in a child process, see `open_guarded`. Raises FileFormatError
    where the file cannot be read, MissingExtraError where the library for its format is not
    installed, and the errors of its reader.
    """
    measure_regular_file(path, FileFormatError)
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError as fault:
        what = f"cannot read the file: {fault.strerror}"
        raise FileFormatError(what, "check the path", Where(file=str(path))) from None
    chosen = _select_format(head, path)
    options = options or ReadOptions()
    if chosen.guarded:
        return open_guarded(chosen.opener, path, options)
    return chosen.opener(path, options)


def _select_format(head: bytes, path: Path) -> LogFormat:
    for one in FORMATS:
        if one.starts and head.startswith(one.starts):
            return one
    for magic, name in _REFUSED.items():
        if head.startswith(magic):
            raise FileFormatError(
                f"this is {name}, for which there is no reader",
                "export the channels as CSV with a row of units, MDF 4, MATLAB or Parquet, frames "
                "of a bus as ASC, BLF, TRC or candump",
                Where(file=str(path)),
            )
    for one in FORMATS:
        if one.recognises(head):
            return one
    refuse_bus_tool(head, path)
    return CSV_FORMAT
