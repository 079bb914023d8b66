# SPDX-License-Identifier: MIT
"""Limit on the decompressed size of MATLAB files, checked before decompression.

The reader would otherwise expand a file of a few megabytes for half a minute before it fails.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

from drivetwin.errors import RefusedError, Where

_HEADER = 128
_TAG = 8
_COMPRESSED = 15
_MAGIC = b"MATLAB 5.0"


def refuse_expansion(path: Path, label: str, limit: int) -> None:
    """Raise RefusedError if the variables of a MATLAB 5 file declare more than `limit` bytes."""
    total = 0
    with path.open("rb") as file:
        head = file.read(_HEADER)
        if not head.startswith(_MAGIC):
            return
        order = "<" if head.endswith(b"IM") else ">"
        while len(tag := file.read(_TAG)) == _TAG:
            kind, size = struct.unpack(f"{order}II", tag)
            start = file.tell()
            total += _read_declared_size(file.read(256), order) if kind == _COMPRESSED else size
            file.seek(start + size)
    if total > limit:
        raise RefusedError(
            f"the file says that it expands to {total / 1e9:.1f} GB, at most {limit / 1e9:.1f} GB "
            "are read",
            "hand in a shorter log, or only the channels that are needed",
            Where(file=label),
        )


def _read_declared_size(packed: bytes, order: str) -> int:
    """Read the declared size [bytes] of a compressed variable; 0 if its header cannot be read."""
    try:
        tag = zlib.decompressobj().decompress(packed, _TAG)
    except zlib.error:
        return 0
    return int(struct.unpack(f"{order}II", tag)[1]) if len(tag) == _TAG else 0
