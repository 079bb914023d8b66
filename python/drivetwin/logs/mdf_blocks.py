# SPDX-License-Identifier: MIT
"""The chains of blocks of an MDF file, walked before a parser that would follow them anywhere.

Blocks point at each other by file position. One flipped bit makes a chain end outside the file or
run in a circle, on which a trusting parser fails late, never ends, or asks for endless memory.
"""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator
from pathlib import Path

from drivetwin.errors import FileFormatError, Where

_HEADER4 = 64
_DEPTH = 16
_MOST_INFLATION = 1100
"""Deflate packs zeros about 1030 to 1; a block that claims more is damaged."""

_LINKS4: dict[bytes, dict[int, bytes]] = {
    b"##HD": {0: b"##DG"},
    b"##DG": {0: b"##DG", 1: b"##CG"},
    b"##CG": {0: b"##CG", 1: b"##CN"},
    b"##CN": {0: b"##CN", 1: b"", 4: b"##CC"},
    b"##CA": {0: b""},
    b"##DL": {0: b"##DL"},
    b"##HL": {0: b"##DL"},
}
"""By block: which of its links lead to which block (empty: any), MDF 4.

A conversion may point at others and at texts; its references are walked as well.
"""

_LINKS3: dict[bytes, dict[int, bytes]] = {
    b"HD": {4: b"DG"},
    b"DG": {4: b"DG", 8: b"CG"},
    b"CG": {4: b"CG", 8: b"CN"},
    b"CN": {4: b"CN"},
}
"""By block: offsets of its links and what they lead to, MDF 3."""


def check_blocks(path: Path) -> None:
    """Raise FileFormatError where the blocks of an MDF file do not form sound chains."""
    size = path.stat().st_size
    if size < _HEADER4 + 64:
        raise _fault(path, f"it ends after {size} bytes")
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        version = int.from_bytes(data[28:30], "little") or int.from_bytes(data[28:30], "big")
        walk = _walk4(data) if 400 <= version < 500 else _walk3(data)
        for problem in walk:
            raise _fault(path, problem)


def _fault(path: Path, what: str) -> FileFormatError:
    return FileFormatError(
        f"the MDF file is cut or damaged: {what}",
        "record or export the log again",
        Where(file=str(path)),
    )


def _walk4(data: mmap.mmap) -> Iterator[str]:
    """Problems of the chains of an MDF 4 file."""
    seen: set[int] = set()
    waiting = [(_HEADER4, b"##HD", 0)]
    while waiting:
        place, expected, depth = waiting.pop()
        if place in seen and expected == b"##CC":
            continue  # channels may share a conversion
        if place in seen or depth > _DEPTH * 1000:
            yield f"blocks at byte {place} form a circle"
            return
        seen.add(place)
        if place % 8 or place + 24 > len(data):
            yield f"a block should stand at byte {place} of {len(data)}"
            return
        kind = data[place : place + 4]
        length, links = struct.unpack_from("<QQ", data, place + 8)
        if (expected and kind != expected) or place + length > len(data) + 8:
            yield f"no sound {expected.decode() or 'block'} at byte {place}"
            return
        if 24 + 8 * links > length:
            yield f"the block at byte {place} claims {links} links in {length} bytes"
            return
        targets = struct.unpack_from(f"<{links}Q", data, place + 24)
        if kind == b"##DG" and links > 2 and targets[2]:
            yield from _data_block(data, targets[2])
        wanted = _LINKS4.get(kind, {})
        if kind == b"##CC" and links > 4:
            wanted = dict.fromkeys(range(4, links), b"")
        waiting += [
            (targets[index], block, depth + 1)
            for index, block in wanted.items()
            if index < links and targets[index] and not (kind == b"##CC" and targets[index] in seen)
        ]


def _data_block(data: mmap.mmap, place: int) -> Iterator[str]:
    """Problems of the samples of a data group: raw, packed, or a list of such."""
    lists: set[int] = set()
    while place:
        if place in lists or place + 40 > len(data):
            yield f"the data list at byte {place} is cut or forms a circle"
            return
        lists.add(place)
        kind = data[place : place + 4]
        (links,) = struct.unpack_from("<Q", data, place + 16)
        if place + 24 + 8 * links > len(data):
            yield f"the data block at byte {place} claims {links} links"
            return
        targets = struct.unpack_from(f"<{links}Q", data, place + 24)
        if kind == b"##HL" and links:
            place = targets[0]
            continue
        parts = targets[1:] if kind == b"##DL" else (place,)
        for part in parts:
            if part:
                yield from _packed(data, part)
        place = targets[0] if kind == b"##DL" and links else 0


def _packed(data: mmap.mmap, place: int) -> Iterator[str]:
    if place + 48 > len(data):
        yield f"data should stand at byte {place} of {len(data)}"
        return
    if data[place : place + 4] != b"##DZ":
        return
    original, packed = struct.unpack_from("<QQ", data, place + 32)
    if place + 48 + packed > len(data) or original > _MOST_INFLATION * packed + 1024:
        yield f"packed data at byte {place} claim {original} bytes from {packed}"


def _walk3(data: mmap.mmap) -> Iterator[str]:
    """Problems of the chains of an MDF 3 file."""
    order = ">" if data[24:26] not in (b"\0\0", b"  ") else "<"
    seen: set[int] = set()
    waiting = [(_HEADER4, b"HD")]
    while waiting:
        place, expected = waiting.pop()
        if place in seen or place + 12 > len(data):
            yield f"blocks at byte {place} of {len(data)} form a circle or end outside"
            return
        seen.add(place)
        if data[place : place + 2] != expected:
            yield f"no {expected.decode()} block at byte {place}"
            return
        for offset, block in _LINKS3[expected].items():
            target = struct.unpack_from(f"{order}I", data, place + offset)[0]
            if target:
                waiting.append((target, block))
