# SPDX-License-Identifier: MIT
"""The chains of blocks of an MDF 4 file, walked before a parser that would follow them anywhere.

Blocks point at each other by file position. One flipped bit makes a chain end outside the file or
run in a circle, on which a trusting parser fails late, never ends, or asks for endless memory.
"""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from drivetwin.errors import FileFormatError, Where

HEADER4 = 64
MOST_INFLATION = 1100
"""Deflate packs zeros about 1030 to 1; a block or group that claims more is damaged."""

_LINKS4: dict[bytes, dict[int, bytes]] = {
    b"##HD": {0: b"##DG", 5: b""},
    b"##DG": {0: b"##DG", 1: b"##CG"},
    b"##CG": {0: b"##CG", 1: b"##CN"},
    b"##CN": {0: b"##CN", 1: b"", 4: b"##CC"},
    b"##CA": {0: b""},
}
"""By block: which of its links lead to which block (empty: any), MDF 4; of a conversion all from
the fifth on.
"""

_FIXED, _VIRTUAL = (0, 2, 4, 5), (3, 6)
"""Kinds of channels whose numbers stand in the record, and of those without numbers."""


def check_blocks(path: Path) -> None:
    """Raise FileFormatError where the blocks of an MDF 4 file do not form sound chains.

    Those of MDF 3 are left to asammdf, which notices their damage.
    """
    size = path.stat().st_size
    if size < HEADER4 + 64:
        raise _make_fault(path, f"it ends after {size} bytes")
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        is_version4 = 400 <= int.from_bytes(data[28:30], "little") < 500
        for problem in find_problems(data) if is_version4 else ():
            raise _make_fault(path, problem)


def _make_fault(path: Path, what: str) -> FileFormatError:
    return FileFormatError(
        f"the MDF file is cut or damaged: {what}",
        "record or export the log again",
        Where(file=str(path)),
    )


@dataclass(frozen=True)
class Block:
    """A block of an MDF 4 file: kind, stated length, links, and start and end of its own data."""

    place: int
    kind: bytes
    length: int
    links: tuple[int, ...]
    body: int
    end: int


def parse_block(data: mmap.mmap, place: int, expected: bytes) -> Block | str:
    """The block at a place, or what is wrong there."""
    if place % 8 or place + 24 > len(data):
        return f"a block is expected at byte {place} of {len(data)}"
    kind = data[place : place + 4]
    length, links = struct.unpack_from("<QQ", data, place + 8)
    if (expected and kind != expected) or place + length > len(data) + 8:
        return f"no sound {expected.decode() or 'block'} at byte {place}"
    body = place + 24 + 8 * links
    if body > place + length or body > len(data):
        return f"the block at byte {place} claims {links} links in {length} bytes"
    targets = struct.unpack_from(f"<{links}Q", data, place + 24)
    return Block(place, kind, length, targets, body, min(place + length, len(data)))


def find_problems(data: mmap.mmap) -> Iterator[str]:
    """Problems of the chains of an MDF 4 file."""
    seen: set[int] = set()
    waiting = [(HEADER4, b"##HD", (0, 0))]
    while waiting:
        place, expected, record = waiting.pop()
        if place in seen and expected in (b"##CC", b""):
            continue  # channels may share a conversion
        if place in seen:
            yield f"blocks at byte {place} form a circle"
            return
        seen.add(place)
        block = parse_block(data, place, expected)
        if isinstance(block, str):
            yield block
            return
        if block.kind == b"##DG":
            yield from _check_data_group4(data, block)
        if block.kind == b"##CG":
            record = _measure_record(data, block)
        if block.kind == b"##CN":
            yield from _check_channel4(data, block, record)
        wanted = _LINKS4.get(block.kind, {})
        if block.kind == b"##CC":
            wanted = dict.fromkeys(range(4, len(block.links)), b"")
        waiting += [
            (block.links[index], kind, record)
            for index, kind in wanted.items()
            if index < len(block.links) and block.links[index]
        ]


def _measure_record(data: mmap.mmap, group: Block) -> tuple[int, int]:
    """Bytes of a record: of its numbers, and of its marks for invalid ones."""
    if group.body + 32 > group.end:
        return 0, 0
    numbers, marks = struct.unpack_from("<II", data, group.body + 24)
    return numbers, marks


def _check_channel4(data: mmap.mmap, block: Block, record: tuple[int, int]) -> Iterator[str]:
    """A channel must lie inside the record of its group."""
    if block.body + 20 > block.end:
        yield f"the channel at byte {block.place} is cut short"
        return
    kind, _, _, first_bit, first, bits, flags, mark = struct.unpack_from(
        "<BBBBIIII", data, block.body
    )
    if kind in _VIRTUAL:
        return
    if kind in _FIXED and (first_bit > 7 or 8 * first + first_bit + bits > 8 * record[0]):
        yield f"the channel at byte {block.place} lies outside its record of {record[0]} bytes"
    elif flags & 2 and mark >= 8 * record[1]:
        yield f"the channel at byte {block.place} has its mark outside the record"


def _check_data_group4(data: mmap.mmap, block: Block) -> Iterator[str]:
    """The samples must be as many as the one group of a sorted data group claims."""
    if len(block.links) < 3:
        yield f"the data group at byte {block.place} is cut short"
        return
    held = 0
    if block.links[2]:
        held, problem = _measure_data(data, block.links[2])
        if problem:
            yield problem
            return
    group = parse_block(data, block.links[1], b"##CG") if block.links[1] else ""
    if isinstance(group, str) or group.links[:1] != (0,) or group.body + 32 > group.end:
        return  # none, or unsorted: records of several groups mix
    records = struct.unpack_from("<Q", data, group.body + 8)[0]
    needed = records * sum(_measure_record(data, group))
    if needed > held:
        yield f"{records} records need {needed} bytes, the file holds {held}"


def _measure_data(data: mmap.mmap, place: int) -> tuple[int, str]:
    """Bytes of samples in a data block, raw, packed or a list of such; and what is wrong."""
    lists: set[int] = set()
    total = 0
    while place:
        if place in lists:
            return 0, f"the data list at byte {place} forms a circle"
        lists.add(place)
        block = parse_block(data, place, b"")
        if isinstance(block, str):
            return 0, block
        if block.kind == b"##HL" and block.links:
            place = block.links[0]
            continue
        is_list = block.kind in (b"##DL", b"##LD")
        for part in block.links[1:] if is_list else (place,):
            size = _measure_block_data(data, part) if part else 0
            if isinstance(size, str):
                return 0, size
            total += size
        place = block.links[0] if is_list and block.links else 0
    return total, ""


def _measure_block_data(data: mmap.mmap, place: int) -> int | str:
    """Bytes that a raw or packed data block holds, or what is wrong with it."""
    block = parse_block(data, place, b"")
    if isinstance(block, str):
        return block
    if block.kind != b"##DZ":
        return block.end - block.body
    if block.body + 24 > block.end:
        return f"the packed data at byte {place} are cut short"
    original, packed = struct.unpack_from("<QQ", data, block.body + 8)
    if block.body + 24 + packed > len(data) or original > MOST_INFLATION * packed + 1024:
        return f"packed data at byte {place} claim {original} bytes from {packed}"
    return int(original)
