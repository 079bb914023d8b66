# SPDX-License-Identifier: MIT
"""Integrity of a MATLAB 5 file, before SciPy reads it: its reader trusts damaged bytes.

The file is a header of 128 bytes and elements of a tag (type, length) and data. Compressed elements
carry a checksum, which SciPy does not look at; others consist of parts with tags of their own. An
unknown type in either can end the process.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from drivetwin.errors import FileFormatError, Where

_HEADER = 128
_MATRIX, _COMPRESSED = 14, 15
_UINT32 = 6
_PARTS = frozenset((*range(1, 8), 9, 12, 13, _MATRIX, 16, 17, 18))
"""Types that a part of a matrix may have."""
_NUMBERS = {4: 1, 5: 3, **dict.fromkeys(range(6, 16), 1)}
"""Parts with numbers of each class: text, sparse (rows, columns, values), plain arrays."""
_COMPLEX = 0x800
_DEEPEST = 50
"""Deepest nesting of structs and cells that is followed."""
_CHUNK = 1 << 20


def check_blocks(path: Path) -> None:
    """Raise FileFormatError where an element is cut, of no known type, or fails its checksum."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_HEADER)
        if len(head) < _HEADER or head[126:128] not in (b"IM", b"MI"):
            return  # version 4 has neither header nor elements
        order = "<" if head[126:128] == b"IM" else ">"
        for number, (kind, length) in enumerate(_elements(file, order), start=1):
            start = file.tell()
            if kind not in (_MATRIX, _COMPRESSED):
                raise _damaged(f"variable {number} has the unknown type {kind}", path)
            if start + length > size:
                raise _damaged(f"variable {number} is cut at the end of the file", path)
            if kind == _COMPRESSED and not _sound(file, length):
                raise _damaged(f"variable {number} does not match its checksum", path)
            if kind == _MATRIX and not _ordered(file, start + length, order):
                raise _damaged(f"variable {number} has parts of no known type or length", path)
            file.seek(start + length)


def _elements(file: BinaryIO, order: str) -> Iterator[tuple[int, int]]:
    """Type and length of each element; the caller leaves the file where the next one starts."""
    while len(tag := file.read(8)) == 8:
        kind, length = struct.unpack(f"{order}II", tag)
        yield kind, length


def _sound(file: BinaryIO, length: int) -> bool:
    """Whether `length` bytes are one whole compressed stream."""
    stream = zlib.decompressobj()
    try:
        while length > 0 and (chunk := file.read(min(length, _CHUNK))):
            length -= len(chunk)
            while chunk:
                stream.decompress(chunk, _CHUNK)
                chunk = stream.unconsumed_tail
    except zlib.error:
        return False
    return stream.eof


def _ordered(file: BinaryIO, end: int, order: str, depth: int = 0) -> bool:
    """Whether a matrix up to `end` consists of whole parts of known types, first its flags."""
    kinds: list[int] = []
    flags = 0
    while (place := file.tell()) < end:
        tag = file.read(8)
        if len(tag) < 8 or depth > _DEEPEST:
            return False
        kind, length = struct.unpack(f"{order}II", tag)
        data = place + 8
        if kind >> 16:  # up to four bytes stand in the tag itself
            kind, length, data = kind & 0xFFFF, kind >> 16, place + 4
        if kind not in _PARTS or data + length > max(end, place + 8):
            return False
        if not kinds:
            if (kind, length) != (_UINT32, 8):
                return False
            (flags,) = struct.unpack(f"{order}I", file.read(4).rjust(4, b"\0"))
        kinds.append(kind)
        if kind == _MATRIX and length and not _ordered(file, data + length, order, depth + 1):
            return False
        file.seek(place + 8 if data == place + 4 else data + -(-length // 8) * 8)
    return _complete(kinds, flags)


def _complete(kinds: list[int], flags: int) -> bool:
    """Whether an array has the parts that its class and its complex flag announce.

    Flags, sizes, name, then the numbers; other classes hold matrices, which SciPy checks itself.
    """
    announced = _NUMBERS.get(flags & 0xFF)
    if announced is None:
        return True
    count = announced + (1 if flags & _COMPLEX else 0)
    return len(kinds) == 3 + count and _MATRIX not in kinds


def _damaged(what: str, path: Path) -> FileFormatError:
    return FileFormatError(
        f"not readable as a MATLAB file: {what}",
        "the file is damaged or was not copied whole: export it again",
        Where(file=str(path)),
    )
