# SPDX-License-Identifier: MIT
"""Size to which a MATLAB file grows when it is read, from its declarations alone.

Variables are compressed, by up to a thousand to one where they are constant, and MATLAB stores
whole numbers of any class in the smallest type that holds them. A file of version 5 is elements,
each with a tag of type and length; a compressed element holds one matrix, and the matrix of a
struct or cell holds those of its fields. Its version 7.3 is HDF5.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO, Protocol

from drivetwin.errors import ReaderFailureError, Where

EXPANDED = 2**29
"""Bytes to which the variables of a small file may grow: 18 channels of an hour at 1 kHz. A larger
log is read in parts, because the reader needs several copies of all variables at once."""
EXPANDED_PER_BYTE = 16
"""Bytes to which each byte of a file may grow besides; noise compresses by less."""

_HEADER = 128
_MATRIX, _COMPRESSED = 14, 15
_CONTAINERS = (1, 2, 3)
"""Classes of a matrix that holds matrices: cell, struct, object."""
_WIDTHS = {4: 4, **dict.fromkeys(range(6, 16), 8)}
"""Bytes of a number by its class: texts as read; numbers, which become float64."""
_COMPLEX = 0x0800
_PIECE = 1 << 16
_DEEPEST = 32
"""Structs nested deeper count by their own length."""


def compute_expansion_limit(size: int) -> int:
    """Return the bytes to which a file of `size` bytes may grow."""
    return EXPANDED + EXPANDED_PER_BYTE * size


def refuse_expansion(path: Path, limit: int) -> None:
    """Raise ReaderFailureError if the variables of a file of version 5 grow above `limit` [bytes].

    Nothing is kept of what is decompressed for this.
    """
    total = 0
    with path.open("rb") as file:
        head = file.read(_HEADER)
        if not head.startswith(b"MATLAB 5.0"):
            return
        order = "<" if head.endswith(b"IM") else ">"
        while len(tag := file.read(8)) == 8:
            kind, size = struct.unpack(f"{order}II", tag)
            start = file.tell()
            if kind == _COMPRESSED:
                packed = _Unpacked(file, size)
                inner = packed.read(8)
                kind, inside = struct.unpack(f"{order}II", inner) if len(inner) == 8 else (0, 0)
                stream: _Stream = packed
            else:
                inside, stream = size, _Plain(file)
            for grown in _measure(stream, kind, inside, order, 0):
                total += grown
                _check(path, total, limit)
            file.seek(start + size)


def refuse_hdf5_expansion(file: Any, path: Path, limit: int) -> None:
    """Raise ReaderFailureError if the data sets of an open HDF5 file grow above `limit` [bytes]."""
    total = 0

    def add(_: str, item: Any) -> None:
        nonlocal total
        total += 8 * int(getattr(item, "size", 0) or 0)

    file.visititems(add)
    _check(path, total, limit)


def _check(path: Path, total: int, limit: int) -> None:
    if total > limit:
        raise ReaderFailureError(
            f"its variables expand to {total / 1e9:.2f} GB or more, the limit for a file of "
            f"{path.stat().st_size / 1e6:.2f} MB is {limit / 1e9:.2f} GB, because the reader "
            "needs several copies",
            "hand in a shorter log, or only the channels that are needed",
            Where(file=str(path)),
        )


class _Stream(Protocol):
    def read(self, count: int) -> bytes: ...
    def skip(self, count: int) -> None: ...


class _Plain:
    """Bytes of a file as they are."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file

    def read(self, count: int) -> bytes:
        return self._file.read(count)

    def skip(self, count: int) -> None:
        self._file.seek(count, 1)


class _Unpacked:
    """Bytes of a compressed element of `size` bytes, in pieces; they end where it is damaged."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file, self._left = file, size
        self._unpacker = zlib.decompressobj()
        self._held = b""

    def read(self, count: int) -> bytes:
        while len(self._held) < count and (piece := self._unpack()):
            self._held += piece
        found, self._held = self._held[:count], self._held[count:]
        return found

    def skip(self, count: int) -> None:
        count -= len(self.read(min(count, len(self._held))))
        while count > 0 and (piece := self._unpack()):
            self._held = piece[count:]
            count -= len(piece)

    def _unpack(self) -> bytes:
        """Return the next bytes, empty at the end or where the data are damaged."""
        while True:
            packed = self._unpacker.unconsumed_tail
            if not packed:
                packed = self._file.read(min(_PIECE, self._left))
                self._left -= len(packed)
            if not packed or self._unpacker.eof:
                return b""
            try:
                if piece := self._unpacker.decompress(packed, _PIECE):
                    return piece
            except zlib.error:
                return b""


def _measure(stream: _Stream, kind: int, size: int, order: str, depth: int) -> Iterator[int]:
    """Yield the bytes to which the matrices in an element of `size` bytes grow."""
    if kind != _MATRIX or depth > _DEEPEST:
        yield size
        return
    used, flags = _read_element(stream, order)
    more, dims = _read_element(stream, order)
    if len(flags) < 4 or len(dims) % 4 or used + more > size:
        yield size
        return
    number = struct.unpack(f"{order}I", flags[:4])[0]
    count = 1
    for one in struct.unpack(f"{order}{len(dims) // 4}i", dims):
        count *= max(one, 0)
    if number & 0xFF not in _CONTAINERS:
        factor = 2 if number & _COMPLEX else 1
        yield max(size, count * factor * _WIDTHS.get(number & 0xFF, 0))
        return
    left = size - used - more
    while left >= 8 and len(tag := stream.read(8)) == 8:
        inner, length = struct.unpack(f"{order}II", tag)
        left -= 8
        if inner >> 16:  # the data stand in the tag
            continue
        end = min(left, length + -length % 8)
        if inner == _MATRIX:
            inside = _Counted(stream)
            yield from _measure(inside, inner, length, order, depth + 1)
            stream.skip(max(end - inside.count, 0))
        else:
            stream.skip(end)
        left -= end


class _Counted:
    """A stream that counts the bytes taken from it."""

    def __init__(self, stream: _Stream) -> None:
        self._stream = stream
        self.count = 0

    def read(self, count: int) -> bytes:
        found = self._stream.read(count)
        self.count += len(found)
        return found

    def skip(self, count: int) -> None:
        self._stream.skip(count)
        self.count += count


_LONGEST_HEAD = 1024
"""Bytes of the flags or dimensions of a matrix at most."""


def _read_element(stream: _Stream, order: str) -> tuple[int, bytes]:
    """Bytes that a short element takes, and its data; none where it is damaged or long."""
    tag = stream.read(8)
    if len(tag) < 8:
        return 8, b""
    kind, length = struct.unpack(f"{order}II", tag)
    if kind >> 16:
        return 8, tag[4 : 4 + min(kind >> 16, 4)]
    if length > _LONGEST_HEAD:
        return 8, b""
    padded = length + -length % 8
    return 8 + padded, stream.read(padded)[:length]
