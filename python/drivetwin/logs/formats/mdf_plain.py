# SPDX-License-Identifier: MIT
"""Reader of plain MDF 4 files: samples by their position, without asammdf.

A file is plain if it is finished and sound, each data group has one channel group of records that
stand uncompressed in the file, and each channel is a little-endian number of 8, 16, 32 or 64 bits
in these records with a linear conversion or none. All other files are left to asammdf in its child
process. All offsets and sizes of a plain file are checked before a sample is read, so that it needs
no child.
"""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from drivetwin._util.optional_dependencies import handle_parser_errors
from drivetwin.channels.roles import ReadOptions
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.logs.formats.can.open import has_only_frames
from drivetwin.logs.formats.mdf import KIND, MdfRecording
from drivetwin.logs.formats.mdf_structure import (
    HEADER4,
    Block,
    find_problems,
    parse_block,
    scale_linear,
)
from drivetwin.logs.raw import Recording

_PIECE = 1 << 20
"""Bytes of records read at a time."""

_VERSIONS = {b"4.00": 400, b"4.10": 410, b"4.11": 411, b"4.20": 420}
"""Version number of a file by the text beside it."""

_TEXTS = (b"##TX", b"##MD")
_NUMBERS = {0: "u", 2: "i", 4: "f"}
"""NumPy kind of the little-endian types of numbers."""

_WIDTHS = {"u": (8, 16, 32, 64), "i": (8, 16, 32, 64), "f": (16, 32, 64)}
_VALUE, _MASTER, _TIME = 0, 2, 1
"""Types of a channel in the record; the content of a master that is time."""

_HARMLESS = 0b1000_0111_1100
"""Flags of a channel that state precision, ranges, discrete values or increasing ones."""

_CHANNEL_ROOM = 168
"""Bytes that asammdf reads of a channel without attachments."""


class _NotPlainError(Exception):
    """The file is not plain."""


@dataclass(frozen=True)
class _Channel:
    """A channel, with the attributes of asammdf that `MdfRecording` reads.

    Its values are `scale` times the number of type `dtype` at byte `offset` of a record, plus
    `shift`; they come converted, so that no `conversion` remains.
    """

    name: str
    unit: str
    channel_type: int
    sync_type: int
    offset: int
    dtype: np.dtype[Any]
    scale: float = 1.0
    shift: float = 0.0
    conversion: None = None


@dataclass(frozen=True)
class _Records:
    """Head of a channel group, named as in asammdf."""

    acq_name: str
    comment: str
    cycles_nr: int
    samples_byte_nr: int


@dataclass(frozen=True)
class _Group:
    """A channel group; `parts` are the first byte and the number of records of each data block."""

    channel_group: _Records
    channels: tuple[_Channel, ...]
    parts: tuple[tuple[int, int], ...]


def open_plain(path: Path, options: ReadOptions) -> AbstractContextManager[Recording] | None:
    """Open a plain MDF 4 file; None if the file is not plain."""
    try:
        groups = _parse_groups(path)
    except (_NotPlainError, ValueError, struct.error, OSError):
        return None
    return _open_groups(groups, path, options)


@contextmanager
def _open_groups(groups: list[_Group], path: Path, options: ReadOptions) -> Iterator[Recording]:
    with path.open("rb") as file:
        with handle_parser_errors(KIND, path):
            recording = MdfRecording(_PlainFile(file, groups), path, options)
        yield recording


class _PlainFile:
    """An open plain file, with the methods of asammdf that `MdfRecording` calls."""

    def __init__(self, file: BinaryIO, groups: list[_Group]) -> None:
        self._file = file
        self.groups = groups
        self.masters_db = {
            number: index
            for number, group in enumerate(groups)
            for index, channel in enumerate(group.channels)
            if channel.channel_type == _MASTER
        }

    def get_channel_unit(self, group: int, index: int) -> str:
        """Return the unit of a channel, empty without any."""
        return self.groups[group].channels[index].unit

    def get_master(
        self, index: int, record_offset: int = 0, record_count: int | None = None
    ) -> FloatArray:
        """Return the stamps (n,) of a group, of all records or some."""
        count = self.groups[index].channel_group.cycles_nr if record_count is None else record_count
        return self.get(index, self.masters_db[index], record_offset, count)[0]

    def get(
        self, group: int, index: int, record_offset: int, record_count: int, **_: Any
    ) -> tuple[FloatArray, None]:
        """Return the values (n,) of a channel; no sample is marked invalid."""
        head, parts = self.groups[group].channel_group, self.groups[group].parts
        width, channel = head.samples_byte_nr, self.groups[group].channels[index]
        record = np.dtype(
            {
                "names": ["x"],
                "formats": [channel.dtype],
                "offsets": [channel.offset],
                "itemsize": width,
            }
        )
        count = min(record_count, head.cycles_nr - record_offset)
        values = np.empty(count)
        step = max(1, _PIECE // width)
        start = -record_offset  # of the records of a part, among the values
        for place, held in parts:
            end = min(start + held, count)
            for low in range(max(start, 0), end, step):
                high = min(low + step, end)
                self._file.seek(place + (low - start) * width)
                numbers = np.fromfile(self._file, record, high - low)["x"]
                values[low:high] = scale_linear(
                    numbers.astype(np.float64), channel.scale, channel.shift
                )
            start += held
        return values, None


def _parse_groups(path: Path) -> list[_Group]:
    """Channel groups of a plain file; raises _NotPlainError for other files."""
    with path.open("rb") as file:
        _require(file.read(8) == b"MDF     ")
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            _require(len(data) > HEADER4)
            version, *unfinished = struct.unpack_from("<H30x2H", data, 28)
            _require(_VERSIONS.get(data[8:16].rstrip(b" \0")) == version and unfinished == [0, 0])
            _require(not any(find_problems(data)))
            groups = list(_iterate_groups(data))
    _require(any(len(group.channels) > 1 for group in groups))
    _require(not any(has_only_frames(group) for group in groups))
    return groups


def _require(is_plain: bool) -> None:
    if not is_plain:
        raise _NotPlainError


def _parse(data: mmap.mmap, place: int, kinds: tuple[bytes, ...], size: int = 0) -> Block:
    """A sound block of one of the kinds, of `size` bytes if that is given."""
    block = parse_block(data, place, b"")
    if isinstance(block, str):
        raise _NotPlainError
    _require(block.kind in kinds and block.place + block.length <= len(data))
    _require(size in (0, block.length))
    return block


def _parse_chain(data: mmap.mmap, place: int, kind: bytes, size: int = 0) -> Iterator[Block]:
    """Blocks of a chain, each with a link to the next one first."""
    seen: set[int] = set()
    while place:
        _require(place not in seen)
        seen.add(place)
        block = _parse(data, place, (kind,), size)
        yield block
        _require(bool(block.links))
        place = block.links[0]


def _parse_text(data: mmap.mmap, place: int) -> str:
    """Text of a block up to its first zero byte, without spaces around it; empty without any."""
    if not place:
        return ""
    block = _parse(data, place, _TEXTS)
    _require(not block.links)
    end = data.find(b"\0", block.body, block.end)
    return data[block.body : block.end if end < 0 else end].strip(b" \r\t\n").decode()


def _check_source(data: mmap.mmap, place: int) -> None:
    """Require a sound description of the source of a channel or group, or none."""
    if place:
        source = _parse(data, place, (b"##SI",), 56)
        _require(len(source.links) == 3)
        for text in source.links:
            _parse_text(data, text)


def _iterate_groups(data: mmap.mmap) -> Iterator[_Group]:
    """Channel groups of a file; what asammdf reads beside them must be sound too."""
    header = _parse(data, HEADER4, (b"##HD",), 104)
    _require(len(header.links) == 6)
    first, history, _, attachment, event, comment = header.links
    _require(not attachment and not event)
    _parse_text(data, comment)
    for entry in _parse_chain(data, history, b"##FH", 56):
        _require(len(entry.links) == 2)
        _parse_text(data, entry.links[1])
    for block in _parse_chain(data, first, b"##DG", 64):
        _require(len(block.links) == 4 and data[block.body] == 0)
        _parse_text(data, block.links[3])
        yield _parse_group(data, block)


def _parse_group(data: mmap.mmap, data_group: Block) -> _Group:
    _, place, samples, _ = data_group.links
    block = _parse(data, place, (b"##CG",), 104)
    _require(len(block.links) == 6)
    following, first, name, source, _, comment = block.links
    records, flags, width, marks = struct.unpack_from("<8xQH6xII", data, block.body)
    _require(not (following or flags or marks) and width > 0)
    _check_source(data, source)
    channels = tuple(
        _parse_channel(data, channel, width) for channel in _parse_chain(data, first, b"##CN", 160)
    )
    _require([one.channel_type for one in channels].count(_MASTER) == 1)
    parts = tuple(_iterate_parts(data, samples, width))
    _require(sum(held for _, held in parts) == records and records * width <= len(data))
    head = _Records(_parse_text(data, name), _parse_text(data, comment), records, width)
    return _Group(head, channels, parts)


def _parse_channel(data: mmap.mmap, block: Block, width: int) -> _Channel:
    """A channel of records of `width` bytes."""
    _require(len(block.links) == 8 and block.place + _CHANNEL_ROOM <= len(data))
    _, component, name, source, conversion, samples, unit, comment = block.links
    kind, content, number, first_bit, offset, bits, flags, attachments = struct.unpack_from(
        "<4B3I6xH", data, block.body
    )
    _require(kind == _VALUE or (kind == _MASTER and content == _TIME))
    _require(not (component or samples or first_bit or attachments or flags & ~_HARMLESS))
    letter = _NUMBERS.get(number, "")
    _require(bits in _WIDTHS.get(letter, ()) and 8 * offset + bits <= 8 * width)
    _check_source(data, source)
    _parse_text(data, comment)
    physical_unit, scale, shift = _parse_conversion(data, conversion)
    own_unit = _parse_text(data, unit)
    return _Channel(
        _parse_text(data, name),
        physical_unit or own_unit,
        kind,
        content,
        offset,
        np.dtype(f"<{letter}{bits // 8}"),
        scale,
        shift,
    )


def _parse_conversion(data: mmap.mmap, place: int) -> tuple[str, float, float]:
    """Unit, scale and shift of a linear conversion, or of none."""
    if not place:
        return "", 1.0, 0.0
    block = _parse(data, place, (b"##CC",))
    _require(len(block.links) == 4 and block.length in (80, 96))
    kind, references, parameters = struct.unpack_from("<B3xHH", data, block.body)
    _require((kind, references, parameters, block.length) in ((0, 0, 0, 80), (1, 0, 2, 96)))
    name, unit, comment, _ = block.links
    for text in (name, comment):
        _parse_text(data, text)
    shift, scale = struct.unpack_from("<2d", data, block.body + 24) if kind else (0.0, 1.0)
    return _parse_text(data, unit), scale, shift


def _iterate_parts(data: mmap.mmap, place: int, width: int) -> Iterator[tuple[int, int]]:
    """First byte and number of records of each data block, in a list or alone."""
    places = [place] if place else []
    if place and data[place : place + 4] == b"##DL":
        places = []
        for block in _parse_chain(data, place, b"##DL"):
            count = len(block.links) - 1
            flags, blocks = struct.unpack_from("<B3xI", data, block.body)
            _require(block.length == 24 + 8 * (1 + count) + (16 if flags else 8 + 8 * count))
            _require(flags in (0, 1) and blocks == count)
            places += block.links[1:]
    for start in places:
        part = _parse(data, start, (b"##DT",))
        size = part.end - part.body
        _require(not part.links and size % width == 0)
        yield part.body, size // width
