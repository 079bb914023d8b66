# SPDX-License-Identifier: MIT
"""Border for files that users name: only regular files are opened."""

from __future__ import annotations

import hashlib
import math
import stat
from pathlib import Path

from drivetwin.errors import DrivetwinError, Where

_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


LARGEST_RECORD = 200_000_000
"""Largest file [bytes] that is read into memory as one text: results, parameters, databases."""


def measure_regular_file(
    path: Path,
    error: type[DrivetwinError],
    remedy: str = "check the path",
    largest: float = math.inf,
) -> int:
    """Return the size [bytes] of a regular file, without opening it.

    A device, named pipe or socket could block or never end. Symbolic links are followed. Raises
    `error`, with `remedy`, where the path is missing, and where it is no regular file or has more
    than `largest` bytes.
    """
    where = Where(file=str(path))
    try:
        status = path.stat()
    except (OSError, ValueError) as fault:  # ValueError: the path contains a NUL
        why = getattr(fault, "strerror", None) or fault
        raise error(f"cannot read the file: {why}", remedy, where) from None
    if kind := _name_kind(status.st_mode):
        what = f"cannot read the file: it is {kind}, not a regular file"
        raise error(what, "name a regular file; copy the data into one first", where)
    if status.st_size > largest:
        what = f"the file has {status.st_size / 1e6:.1f} MB, at most {largest / 1e6:g} MB are read"
        raise error(what, "hand in a file written for this purpose", where)
    return status.st_size


def find_special_kind(path: Path) -> str | None:
    """Return the kind of what exists at a path, such as `a device`; None for a regular file.

    None is also returned where nothing can be found there.
    """
    try:
        return _name_kind(path.stat().st_mode)
    except (OSError, ValueError):
        return None


def _name_kind(mode: int) -> str | None:
    """Return the kind of file by its mode; None for a regular file."""
    if stat.S_ISREG(mode):
        return None
    return next((name for is_kind, name in _KINDS if is_kind(mode)), "special")


def compute_digest(path: Path) -> str:
    """Compute the SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
