# SPDX-License-Identifier: MIT
"""Reader of MATLAB files: v4 to v7 by SciPy, v7.3 (HDF5) by pymatreader.

A channel is `x` with its time `x_t`, a vector beside one time vector, or a struct of time and data.

SciPy notices most damage of a file of version 5, and the checksums of its compressed variables. A
file on which it crashes costs the child process that reads it. Two things it does not notice: a
small file that expands to gigabytes, and a variable of version 4 that is cut or has another head.
A file of version 4 is variables only: five numbers (type, rows, columns, whether complex, length of
the name), name and data.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO, Protocol

import numpy as np

from drivetwin._util.optional_dependencies import handle_parser_errors, import_extra
from drivetwin.channels.read_options import ReadOptions
from drivetwin.errors import FileFormatError, MissingChannelError, ReaderFailureError, Where
from drivetwin.logs.raw import (
    RawLog,
    Recording,
    describe_origin,
    find_origin,
    subtract_origin,
)

EXPANDED = 2**29
"""Bytes to which the variables of a small file may grow: 18 channels of an hour at 1 kHz. A larger
log is read in parts, because the reader needs several copies of all variables at once."""
EXPANDED_PER_BYTE = 16
"""Bytes to which each byte of a file may grow besides; noise compresses by less."""

_MAT_SIZE_HEADER = 128
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
        head = file.read(_MAT_SIZE_HEADER)
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


_KIND = "a MATLAB file"
_PLAIN = (
    "export plain arrays: <name>, <name>_t with its time in s, and <name>_unit; timetables and "
    "Simulink data sets are closed objects"
)

_HEADER = 128
"""Bytes of the header of version 5; elements follow, each with a tag of type and length."""
_HEAD4 = 20
_BYTES4 = (8, 4, 4, 2, 2, 1)
"""Bytes of a number by its kind in version 4: double, single, four kinds of integers."""
_LONGEST4 = 256
"""Letters that the name of a variable of version 4 has at most, with the zero at its end."""


@contextmanager
def open_mat(path: Path, options: ReadOptions) -> Iterator[Recording]:
    """Read a MATLAB file of version 4 to 7.3.

    Time is in s, unless the file (`<name>_t_unit`, `time_unit`) or the mapping gives another unit.
    Raises MissingExtraError (v7.3 without pymatreader), FileFormatError for a damaged file or one
    with closed objects only, MissingChannelError without any time vector, UnitError.
    """
    from drivetwin.logs.formats.mat_signals import find_signals  # not needed to recognise a file

    with path.open("rb") as file:
        is_hdf5 = file.read(10) == b"MATLAB 7.3"
    with handle_parser_errors(_KIND, path):
        tree = _read_hdf5_tree(path) if is_hdf5 else _read_tree(path)
        found = find_signals(tree, options.time, str(path))
    if not found.channels:
        raise _make_no_signal_error(tree, found.unreadable, path)
    origin = find_origin(channel.time[0] for channel in found.channels)
    channels = tuple(replace(one, time=subtract_origin(one.time, origin)) for one in found.channels)
    yield RawLog(channels, found.unreadable, describe_origin(origin), str(path))


def _make_no_signal_error(
    tree: Mapping[str, Any], unreadable: Mapping[str, str], path: Path
) -> FileFormatError | MissingChannelError:
    where = Where(file=str(path))
    if not tree:
        return FileFormatError("the file holds no variables", _PLAIN, where)
    reasons = "; ".join(f"{name}: {why}" for name, why in unreadable.items())
    what = f"no variable has a time vector among {', '.join(list(tree)[:20])}"
    return MissingChannelError(f"{what} ({reasons})" if reasons else what, _PLAIN, where)


def _read_tree(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat

    refuse_expansion(path, compute_expansion_limit(path.stat().st_size))
    _check_version4(path)
    content = loadmat(path, struct_as_record=False, squeeze_me=True, appendmat=False)
    return {name: _to_plain(v) for name, v in content.items() if not name.startswith("__")}


def _to_plain(value: Any) -> Any:
    """A struct as a dict, an array of structs as a list; other values as they are."""
    fields = getattr(value, "_fieldnames", None)
    if fields is not None:
        return {name: _to_plain(getattr(value, name)) for name in fields}
    if isinstance(value, np.ndarray) and value.dtype == object:
        return [_to_plain(item) for item in value.ravel()]
    return value


def _read_hdf5_tree(path: Path) -> dict[str, Any]:
    h5py = import_extra("h5py", "io", "a MATLAB 7.3 file", path)
    pymatreader = import_extra("pymatreader", "io", "a MATLAB 7.3 file", path)
    with h5py.File(path, "r") as file:
        refuse_hdf5_expansion(file, path, compute_expansion_limit(path.stat().st_size))
    content: dict[str, Any] = pymatreader.read_mat(str(path))
    return {
        name: _split_struct_array(v) for name, v in content.items() if not name.startswith("__")
    }


def _split_struct_array(value: Any) -> Any:
    """An array of structs, which arrives as one struct of lists, as a list of structs."""
    if not isinstance(value, dict):
        return [_split_struct_array(item) for item in value] if isinstance(value, list) else value
    value = {name: _split_struct_array(item) for name, item in value.items()}
    lists = [item for item in value.values() if isinstance(item, list)]
    if lists and len(lists) == len(value) and len({len(item) for item in lists}) == 1:
        return [dict(zip(value, row, strict=True)) for row in zip(*lists, strict=True)]
    return value


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
    thousands, number, text = kind // 1000, kind // 10 % 10, kind % 10
    if thousands != (order == ">") or kind // 100 % 10 or number >= len(_BYTES4) or text > 2:
        return None
    if min(rows, columns) < 0 or imaginary not in (0, 1) or not 1 < name <= _LONGEST4:
        return None
    return name, rows * columns * _BYTES4[number] * (1 + imaginary)


def _check_version4(path: Path) -> None:
    """Raise FileFormatError where a variable of a file of version 4 is cut or has no sound head."""
    size = path.stat().st_size
    place, number = 0, 0
    with path.open("rb") as file:
        if not is_version4(file.read(_HEADER)):
            return
        while place < size:
            file.seek(place)
            number += 1
            variable = _measure_variable4(file.read(_HEAD4))
            place += size if variable is None else _HEAD4 + sum(variable)
            if place > size:
                what = f"variable {number} {'is cut' if variable else 'has no sound head'}"
                raise FileFormatError(
                    f"not readable as a MATLAB file: {what}",
                    "the file is damaged or was not copied whole: export it again",
                    Where(file=str(path)),
                )
