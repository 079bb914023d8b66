# SPDX-License-Identifier: MIT
"""Integrity of a MATLAB 4 or 5 file, before SciPy reads it: its reader trusts damaged bytes.

A file of version 5 is a header of 128 bytes and elements of a tag (type, length) and data.
Compressed elements carry a checksum, which SciPy does not look at; others consist of parts with
tags of their own. An unknown type in either can end the process. A file of version 4 is variables
only: five numbers (type, rows, columns, whether complex, length of the name), name and data.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from drivetwin.errors import FileFormatError, ReaderFailureError, Where

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

_HEAD4 = 20
_BYTES4 = (8, 4, 4, 2, 2, 1)
"""Bytes of a number by its kind in version 4: double, single, four kinds of integers."""
_LONGEST4 = 256
"""Letters that the name of a variable of version 4 has at most, with the zero at its end."""


def check_blocks(path: Path) -> None:
    """Raise FileFormatError where an element is cut, of no known type, or fails its checksum."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_HEADER)
        if is_version4(head):
            _check_version4(file, size, path)
            return
        if len(head) < _HEADER or head[126:128] not in (b"IM", b"MI"):
            return  # SciPy raises the error
        order = "<" if head[126:128] == b"IM" else ">"
        for number, (kind, length) in enumerate(_iterate_elements(file, order), start=1):
            start = file.tell()
            if kind not in (_MATRIX, _COMPRESSED):
                raise _make_damage_error(f"variable {number} has the unknown type {kind}", path)
            if start + length > size:
                raise _make_damage_error(f"variable {number} is cut at the end of the file", path)
            if kind == _COMPRESSED and not _is_complete_stream(file, length):
                raise _make_damage_error(f"variable {number} does not match its checksum", path)
            if kind == _MATRIX and not _has_valid_elements(file, start + length, order):
                raise _make_damage_error(
                    f"variable {number} has parts of no known type or length", path
                )
            file.seek(start + length)


def refuse_expansion(path: Path, limit: int) -> None:
    """Raise ReaderFailureError if a file of version 5 declares variables above `limit` [bytes].

    Otherwise the reader would expand a file of a few megabytes for half a minute before it fails.
    """
    total = 0
    with path.open("rb") as file:
        head = file.read(_HEADER)
        if not head.startswith(b"MATLAB 5.0"):
            return
        for kind, size in _iterate_elements(file, "<" if head.endswith(b"IM") else ">"):
            start = file.tell()
            total += _read_declared_size(file.read(256), head) if kind == _COMPRESSED else size
            file.seek(start + size)
    if total > limit:
        raise ReaderFailureError(
            f"the file says that it expands to {total / 1e9:.1f} GB, at most {limit / 1e9:.1f} GB "
            "are read",
            "hand in a shorter log, or only the channels that are needed",
            Where(file=str(path)),
        )


def _read_declared_size(packed: bytes, head: bytes) -> int:
    """Read the declared size [bytes] of a compressed variable; 0 if its header cannot be read."""
    try:
        tag = zlib.decompressobj().decompress(packed, 8)
    except zlib.error:
        return 0
    order = "<" if head.endswith(b"IM") else ">"
    return int(struct.unpack(f"{order}II", tag)[1]) if len(tag) == 8 else 0


def is_version4(head: bytes) -> bool:
    """Return True if a file that starts with `head` is one of version 4, which has no mark."""
    variable = _measure_variable4(head[:_HEAD4])
    return variable is not None and head[_HEAD4:][: variable[0]].find(b"\0") == variable[0] - 1


def _measure_variable4(head: bytes) -> tuple[int, int] | None:
    """Bytes of name and data of a variable of version 4; None where its head is none."""
    if len(head) < _HEAD4:
        return None
    order = "<" if head[1:4] == bytes(3) else ">"  # the type is a small number
    kind, rows, columns, imaginary, name = struct.unpack(f"{order}5i", head)
    thousands, number, form = kind // 1000, kind // 10 % 10, kind % 10
    if thousands != (order == ">") or kind // 100 % 10 or number >= len(_BYTES4) or form > 2:
        return None
    if min(rows, columns) < 0 or imaginary not in (0, 1) or not 1 < name <= _LONGEST4:
        return None
    return name, rows * columns * _BYTES4[number] * (1 + imaginary)


def _check_version4(file: BinaryIO, size: int, path: Path) -> None:
    place, number = 0, 0
    while place < size:
        file.seek(place)
        number += 1
        variable = _measure_variable4(file.read(_HEAD4))
        if variable is None:
            raise _make_damage_error(f"variable {number} has no sound head", path)
        place += _HEAD4 + sum(variable)
    if place > size:
        raise _make_damage_error(f"variable {number} is cut at the end of the file", path)


def _iterate_elements(file: BinaryIO, order: str) -> Iterator[tuple[int, int]]:
    """Type and length of each element; the caller leaves the file where the next one starts."""
    while len(tag := file.read(8)) == 8:
        kind, length = struct.unpack(f"{order}II", tag)
        yield kind, length


def _is_complete_stream(file: BinaryIO, length: int) -> bool:
    """Return True if the next `length` bytes are one complete compressed stream."""
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


def _has_valid_elements(file: BinaryIO, end: int, order: str, depth: int = 0) -> bool:
    """Return True if a matrix up to `end` consists of complete elements of known types."""
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
        if (
            kind == _MATRIX
            and length
            and not _has_valid_elements(file, data + length, order, depth + 1)
        ):
            return False
        file.seek(place + 8 if data == place + 4 else data + -(-length // 8) * 8)
    return _has_required_parts(kinds, flags)


def _has_required_parts(kinds: list[int], flags: int) -> bool:
    """Return True if an array has all elements required by its class and complex flag.

    The order is flags, sizes, name, numbers. SciPy itself checks classes that contain matrices.
    """
    announced = _NUMBERS.get(flags & 0xFF)
    if announced is None:
        return True
    count = announced + (1 if flags & _COMPLEX else 0)
    return len(kinds) == 3 + count and _MATRIX not in kinds


def _make_damage_error(what: str, path: Path) -> FileFormatError:
    return FileFormatError(
        f"not readable as a MATLAB file: {what}",
        "the file is damaged or was not copied whole: export it again",
        Where(file=str(path)),
    )
