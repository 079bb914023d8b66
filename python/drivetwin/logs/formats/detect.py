# SPDX-License-Identifier: MIT
"""Detection of the file format from the first bytes; the file name is not used."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path

from drivetwin._util.regular_file import measure_regular_file
from drivetwin.channels.read_options import ReadOptions
from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.formats.can.open import is_bus_text, open_blf, open_bus_text
from drivetwin.logs.formats.can.other_tools import refuse_bus_tool
from drivetwin.logs.formats.csv import open_csv
from drivetwin.logs.formats.guarded import open_guarded
from drivetwin.logs.formats.mat import open_mat
from drivetwin.logs.formats.mat_integrity import is_version4
from drivetwin.logs.formats.mdf import open_mdf
from drivetwin.logs.formats.parquet import open_parquet
from drivetwin.logs.raw import Opener, Recording

SUFFIXES = frozenset(
    (
        *(".csv", ".txt", ".tsv", ".dat", ".lvm", ".msl", ".vbo"),
        *(".mf4", ".mdf", ".mat", ".parquet", ".asc", ".trc", ".blf", ".log"),
    )
)
"""Endings by which a folder's logs are known; a file that is named by itself may have any."""

_HEAD = 8192
"""Number of bytes used to detect a format."""

_BY_MAGIC: dict[bytes, Opener] = {
    b"MDF     ": open_mdf,
    b"UnFinMF ": open_mdf,
    b"MATLAB 5.0": open_mat,
    b"MATLAB 7.3": open_mat,
    b"PAR1": open_parquet,
    b"LOGG": open_blf,
}

_GUARDED = frozenset((open_mdf, open_mat, open_parquet, open_blf))
"""Readers of binary formats, whose libraries trust damaged bytes."""

_REFUSED = {
    b"\x89HDF": "an HDF5 file without MATLAB header",
    b"PK\x03\x04": "a zip archive or Excel workbook",
    b"\x1f\x8b": "a gzip archive",
}
"""First bytes of unsupported formats that an error names instead of `binary`."""


def is_binary_log(head: bytes) -> bool:
    """Return whether the first bytes of a file are those of a binary log format."""
    return any(head.startswith(magic) for magic in _BY_MAGIC)


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
    opener = _select_opener(head, path)
    options = options or ReadOptions()
    return open_guarded(opener, path, options) if opener in _GUARDED else opener(path, options)


def _select_opener(head: bytes, path: Path) -> Opener:
    for magic, opener in _BY_MAGIC.items():
        if head.startswith(magic):
            return opener
    for magic, name in _REFUSED.items():
        if head.startswith(magic):
            raise FileFormatError(
                f"this is {name}, for which there is no reader",
                "export the channels as CSV with a row of units, MDF 4, MATLAB or Parquet, frames "
                "of a bus as ASC, BLF, TRC or candump",
                Where(file=str(path)),
            )
    if is_version4(head):
        return open_mat
    if is_bus_text(head):
        return open_bus_text
    refuse_bus_tool(head, path)
    return open_csv
