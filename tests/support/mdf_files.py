# SPDX-License-Identifier: MIT
"""Random MDF 4 files with known samples, written byte by byte.

A file has groups of channels over their own time; numbers of all types, also as bit fields, in both
byte orders; all conversions to numbers; marks for invalid samples; sorted and unsorted records, in
one block, in lists, or compressed.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.support.arrays import FloatArray

Records = NDArray[np.uint8]
VERSIONS = (b"4.00", b"4.10", b"4.11", b"4.20")
_EDGES = np.arange(-50.0, 200.0, 5.0)
"""Keys and ends of ranges in tables."""
FAULTS = ("Fehler", "not available", "SNA", "Init", "ungültig")


@dataclass(frozen=True, eq=False)
class Known:
    """Samples (n,) of a channel as its file means them: `time` [s], values, and which are valid."""

    time: FloatArray
    values: FloatArray
    valid: NDArray[np.bool_]
    kind: str


class Blocks:
    """The bytes of a file, and the random choices for it."""

    def __init__(self, seed: int) -> None:
        self.data = bytearray()
        self.random = np.random.default_rng(seed)

    def chance(self, share: float) -> bool:
        return bool(self.random.random() < share)

    def pick(self, choices: Sequence[Any], shares: Sequence[float] | None = None) -> Any:
        return choices[int(self.random.choice(len(choices), p=shares))]

    def add(self, kind: bytes, links: Sequence[int], body: bytes) -> int:
        """Append a block, in a tenth of the cases behind a hole; return its place."""
        self.data += bytes(-len(self.data) % 8)
        if len(self.data) > 64 and kind != b"##HD" and self.chance(0.1):
            self.data += bytes(8 * int(self.random.integers(1, 4)))
        place = len(self.data)
        size = 24 + 8 * len(links) + len(body)
        self.data += struct.pack(f"<4s4xQQ{len(links)}Q", kind, size, len(links), *links) + body
        return place

    def add_text(self, text: str, kind: bytes = b"##TX") -> int:
        coded = text.encode() + b"\0"
        return self.add(kind, [], coded + bytes(-len(coded) % 8))

    def link(self, place: int, index: int, target: int) -> None:
        struct.pack_into("<Q", self.data, place + 24 + 8 * index, target)

    def chain(self, places: Sequence[int]) -> int:
        """Link blocks to their next one; return the first."""
        for one, following in pairwise(places):
            self.link(one, 0, following)
        return places[0]

    def add_conversion(self, kind: int, values: Sequence[float], links: Sequence[int] = ()) -> int:
        unit = self.add_text("N.m") if self.chance(0.3) else 0
        head = struct.pack("<BBHHHdd", kind, 0, 0, len(links), len(values), 0.0, 0.0)
        numbers = struct.pack(f"<{len(values)}d", *values)
        return self.add(b"##CC", [0, unit, 0, 0, *links], head + numbers)


@dataclass(frozen=True, eq=False)
class Converted:
    """Place of a conversion, the values (n,) that it gives, and the faults (n,) among them."""

    place: int
    values: FloatArray
    faults: NDArray[np.bool_] | None = None


def _keep(_: Blocks, raw: NDArray[Any]) -> Converted:
    return Converted(0, raw.astype(np.float64))


def _repeat(out: Blocks, raw: NDArray[Any]) -> Converted:
    return Converted(out.add_conversion(0, ()), raw.astype(np.float64))


def _scale(out: Blocks, raw: NDArray[Any]) -> Converted:
    scale, shift = out.pick((1.0, 0.1, 1e-3, 1e3, -2.5, 1 / 3)), out.pick((0.0, -40.0, 1e5, 0.7))
    return Converted(out.add_conversion(1, (shift, scale)), raw.astype(np.float64) * scale + shift)


def _divide(out: Blocks, raw: NDArray[Any]) -> Converted:
    p = [0.0, *out.random.uniform((0.5, -5.0), (2.0, 5.0)), 0.0, 0.0, out.random.uniform(0.5, 3.0)]
    if out.chance(0.4):
        p[0], p[4] = 1e-4, 1e-5
    x = raw.astype(np.float64)
    above, below = p[0] * x**2 + p[1] * x + p[2], p[3] * x**2 + p[4] * x + p[5]
    return Converted(out.add_conversion(2, p), above / below)


def _evaluate(out: Blocks, raw: NDArray[Any]) -> Converted:
    place = out.add_conversion(3, (), (out.add_text("X*0.5+3"),))
    return Converted(place, raw.astype(np.float64) * 0.5 + 3.0)


def _draw_table(out: Blocks) -> tuple[FloatArray, FloatArray, list[float]]:
    keys = np.sort(
        out.random.choice(np.arange(-50.0, 200.0, 5.0), out.random.integers(2, 7), False)
    )
    values = out.random.uniform(-9.0, 9.0, keys.size)
    return keys, values, np.column_stack((keys, values)).ravel().tolist()


def _interpolate(out: Blocks, raw: NDArray[Any]) -> Converted:
    keys, values, table = _draw_table(out)
    return Converted(out.add_conversion(4, table), np.interp(raw.astype(np.float64), keys, values))


def _take_nearest(out: Blocks, raw: NDArray[Any]) -> Converted:
    keys, values, table = _draw_table(out)
    x = raw.astype(np.float64)
    far = np.abs(x.clip(keys[0], keys[-1])[:, None] - keys)
    nearest = np.array([int(np.argmin(row)) for row in far], np.intp)  # of a tie the lower key
    return Converted(out.add_conversion(5, table), np.where(np.isnan(x), np.nan, values[nearest]))


def _take_range(out: Blocks, raw: NDArray[Any]) -> Converted:
    edges = np.sort(out.random.choice(_EDGES, 4, replace=False))
    first, second = out.random.uniform(-9.0, 9.0, 2)
    table = (*edges[:2], first, *edges[2:], second, 77.0)
    x, result = raw.astype(np.float64), np.full(raw.size, 77.0)
    for low, high, value in ((*edges[:2], first), (*edges[2:], second)):
        result[(x >= low) & ((x <= high) if raw.dtype.kind in "iu" else (x < high))] = value
    return Converted(out.add_conversion(6, table), result)


def _name_codes(out: Blocks, raw: NDArray[Any]) -> Converted:
    """A table of a fault and a number as text, and a linear conversion of all other codes."""
    scale = out.pick((0.125, 3.0))
    codes = np.unique(raw[np.isfinite(raw)])
    codes = out.random.permutation(codes)[:2] if codes.size > 1 else np.array([1.0, 2.0])
    fault, number = (float(one) for one in codes)
    links = [out.add_text(out.pick(FAULTS)), out.add_text("-7.5")]
    default = out.add(b"##CC", [0] * 4, struct.pack("<BBHHHdddd", 1, 0, 0, 0, 2, 0, 0, 0.5, scale))
    if out.chance(0.5):
        place = out.add_conversion(7, (fault, number), (*links, default))
    else:
        place = out.add_conversion(8, (fault, fault, number, number), (*links, default))
    x = raw.astype(np.float64)
    return Converted(place, np.where(x == number, -7.5, x * scale + 0.5), x == fault)


CONVERSIONS: dict[str, Callable[[Blocks, NDArray[Any]], Converted]] = {
    "none": _keep,
    "identity": _repeat,
    "linear": _scale,
    "rational": _divide,
    "formula": _evaluate,
    "interpolated": _interpolate,
    "nearest": _take_nearest,
    "range": _take_range,
    "texts": _name_codes,
}


@dataclass(frozen=True, eq=False)
class _Number:
    """Layout of a number in a record: raw samples (n,), type, bits from `bit` of byte `offset`."""

    raw: NDArray[Any]
    kind: int
    bits: int
    bit: int = 0
    big: bool = False

    @property
    def width(self) -> int:
        return (self.bit + self.bits + 7) // 8

    def write(self, records: Records, offset: int) -> None:
        part = records[:, offset : offset + self.width]
        if self.kind == 4:
            part[:] = self.raw.astype(f"<f{self.width}").view(np.uint8).reshape(-1, self.width)
        else:
            mask = (1 << self.bits) - 1
            for row, code in zip(part, self.raw.tolist(), strict=True):
                row[:] = list(((int(code) & mask) << self.bit).to_bytes(self.width, "little"))
        if self.big:
            part[:] = part[:, ::-1].copy()


def _draw_number(out: Blocks, count: int) -> _Number:
    big = out.chance(0.2)
    form = out.pick(("f2", "f4", "f8", "whole", "bits"), (0.15, 0.15, 0.2, 0.3, 0.2))
    if form[0] == "f":
        raw = (out.random.normal(size=count) * out.pick((1.0, 100.0, 3000.0))).astype(form)
        if count and out.chance(0.1):
            raw[int(out.random.integers(count))] = np.nan
        return _Number(raw, 4, 8 * int(form[1]), big=big)
    signed = out.chance(0.5)
    bits = 8 * out.pick((1, 2, 3, 4, 5, 8)) if form == "whole" else int(out.random.integers(2, 25))
    bit = 0 if form == "whole" else int(out.random.integers(0, 8))
    spread = min(bits, 62)
    low, high = (-(1 << spread - 1), 1 << spread - 1) if signed else (0, 1 << spread)
    if out.chance(0.4):
        low, high = max(low, -300), min(high, 300)
    raw = out.random.integers(low, high, count).astype(np.int64 if signed else np.uint64)
    return _Number(raw, 2 if signed else 0, bits, bit, big)


def _draw_time(out: Blocks, count: int) -> tuple[_Number, int, FloatArray]:
    """Stamps as numbers, the place of their conversion, and the seconds (n,) that they mean."""
    step, start = out.pick((1e-3, 5e-3, 0.01, 0.1)), out.pick((0.0, 0.25))
    time = np.arange(count) * step + start
    form = out.pick(("f8", "f4", "u8", "u4"), (0.6, 0.1, 0.2, 0.1))
    if form[0] == "f":
        raw = time.astype(form)
        return _Number(raw, 4, 8 * int(form[1]), big=out.chance(0.2)), 0, raw.astype(np.float64)
    tick = 1e-9 if form == "u8" else 1e-4
    ticks = np.round(time / tick).astype(np.uint64)
    body = struct.pack("<BBHHHdddd", 1, 0, 0, 0, 2, 0.0, 0.0, 0.0, tick)
    place = out.add(b"##CC", [0] * 4, body)
    number = _Number(ticks, 0, 8 * int(form[1]), big=out.chance(0.2))
    return number, place, ticks.astype(np.float64) * tick


@dataclass(eq=False)
class _Group:
    """A group: its block, and its records (n, width) with the marks of invalid samples."""

    place: int
    records: Records


@dataclass(eq=False)
class _Writer:
    out: Blocks
    known: dict[str, Known] = field(default_factory=dict)

    def write_group(self, number: int, record_id: int) -> _Group:
        """Write the channels of a group; their samples become `known`."""
        out = self.out
        count = out.pick((0, 1, 12, 200), (0.04, 0.04, 0.22, 0.7))
        stamps, stamps_conversion, time = _draw_time(out, count)
        numbers = [stamps, *(_draw_number(out, count) for _ in range(out.random.integers(1, 7)))]
        offsets, width = _place_numbers(out, numbers)
        marks = out.pick((0, 1), (0.7, 0.3))
        records = np.zeros((count, width + marks), np.uint8)
        for one, offset in zip(numbers, offsets, strict=True):
            one.write(records, offset)
        places = [
            self._add_channel(f"time_{number}", stamps, offsets[0], stamps_conversion, (2, 1))
        ]
        for index, one in enumerate(numbers[1:], start=1):
            name, kind = f"ch{index}_{number}", out.pick(tuple(CONVERSIONS))
            made, valid = CONVERSIONS[kind](out, one.raw), np.ones(count, np.bool_)
            marked = bool(marks) and index < 8 and out.chance(0.6)
            if marked:
                valid = out.random.random(count) > 0.1
                records[~valid, width] |= np.uint8(1 << index)
            place = self._add_channel(name, one, offsets[index], made.place, mark=index * marked)
            places.append(place)
            right = valid if made.faults is None else valid & ~made.faults
            self.known[name] = Known(time, made.values, right, f"{kind} of {one.raw.dtype}")
        label = out.add_text(f"group {number}") if out.chance(0.5) else 0
        body = struct.pack("<QQHH4xII", record_id, count, 0, 0, width, marks)
        return _Group(out.add(b"##CG", [0, out.chain(places), label, 0, 0, 0], body), records)

    def _add_channel(
        self,
        name: str,
        number: _Number,
        offset: int,
        conversion: int,
        kind: tuple[int, int] = (0, 0),
        mark: int = 0,
    ) -> int:
        unit = self.out.add_text("s" if kind[0] else self.out.pick(("Nm", "rpm", "bar")))
        shape = (number.kind + number.big, number.bit, offset, number.bits, 2 * bool(mark), mark)
        body = struct.pack("<4B4I2BH6d", *kind, *shape, *[0] * 9)
        return self.out.add(
            b"##CN", [0, 0, self.out.add_text(name), 0, conversion, 0, unit, 0], body
        )

    def write_data_group(self, first: int, inside: int) -> int:
        """Write `inside` groups into one data group; return its place."""
        out = self.out
        size = out.pick((1, 2, 4, 8)) if inside > 1 else out.pick((0, 0, 0, 1, 2))
        groups = [
            self.write_group(first + index, index + 1 if size else 0) for index in range(inside)
        ]
        data, width = _mix_records(out, groups, size)
        samples = _write_data(out, data, width, cut_anywhere=inside == 1)
        links = [0, out.chain([one.place for one in groups]), samples, 0]
        return out.add(b"##DG", links, struct.pack("<B7x", size))


def _place_numbers(out: Blocks, numbers: Sequence[_Number]) -> tuple[list[int], int]:
    """Byte offset of each number in the record, in any order and with holes; and its width."""
    offsets, width = [0] * len(numbers), 0
    order = range(len(numbers)) if out.chance(0.6) else out.random.permutation(len(numbers))
    for index in order:
        offsets[index] = width
        width += numbers[index].width + (int(out.random.integers(1, 4)) if out.chance(0.15) else 0)
    return offsets, width


def _mix_records(out: Blocks, groups: Sequence[_Group], size: int) -> tuple[bytes, int]:
    """Records of all groups in a random order, each behind its number of `size` bytes."""
    order = np.concatenate([np.full(len(one.records), k) for k, one in enumerate(groups)])
    out.random.shuffle(order)
    waiting = [iter(one.records) for one in groups]
    rows = [
        (k + 1 if size else 0).to_bytes(size, "little") + next(waiting[k]).tobytes()
        for k in order.astype(int).tolist()
    ]
    return b"".join(rows), size + groups[0].records.shape[1]


def _write_data(out: Blocks, data: bytes, width: int, *, cut_anywhere: bool) -> int:
    """Write records in a block, a list of blocks, or compressed; return the place."""
    if not data:
        return 0 if out.chance(0.5) else out.add(b"##DT", [], b"")
    store = out.pick(("DT", "DL", "DL cut", "DZ", "HL"))
    packing = out.pick((1, 2)) if store in ("DZ", "HL") else 0
    if store in ("DT", "DZ"):
        return _write_piece(out, data, packing, width)
    step = max(1, int(len(data) // width * out.random.uniform(0.1, 0.6))) * width
    if store == "DL cut" and cut_anywhere:
        step += int(out.random.integers(0, width))
    pieces = [data[start : start + step] for start in range(0, len(data), step)]
    blocks = [_write_piece(out, piece, packing, width) for piece in pieces]
    equal, lists = out.chance(0.5), []
    for part in np.array_split(np.arange(len(blocks)), min(out.pick((1, 2, 3)), len(blocks))):
        body = struct.pack("<B3xI", equal, part.size)
        body += struct.pack("<Q", step) if equal else (step * part).astype("<u8").tobytes()
        lists.append(out.add(b"##DL", [0, *(blocks[index] for index in part)], body))
    head = out.chain(lists)
    return out.add(b"##HL", [head], struct.pack("<HB5x", equal, packing - 1)) if packing else head


def _write_piece(out: Blocks, piece: bytes, packing: int, width: int) -> int:
    """Write a data block: plain, packed, or packed after its columns were brought together."""
    if not packing:
        return out.add(b"##DT", [], piece)
    turned = piece
    if packing == 2:
        rows = len(piece) // width
        table = np.frombuffer(piece[: rows * width], np.uint8).reshape(rows, width)
        turned = table.T.tobytes() + piece[rows * width :]
    packed = zlib.compress(turned)
    head = struct.pack("<2sBBI", b"DT", packing - 1, 0, width if packing == 2 else 0)
    return out.add(b"##DZ", [], head + struct.pack("<QQ", len(piece), len(packed)) + packed)


def write_random_mdf(path: Path, seed: int) -> dict[str, Known]:
    """Write a file; return what its channels hold, by their names, which occur once."""
    out = Blocks(seed)
    version = out.pick(VERSIONS)
    number = int(version.replace(b".", b""))
    out.data += struct.pack(
        "<8s8s8s4xH30xHH", b"MDF     ", version + b"    ", b"tests   ", number, 0, 0
    )
    stamp = 1_700_000_000 * 10**9
    head = out.add(b"##HD", [0] * 6, struct.pack("<QhhBBBBdd", stamp, *[0] * 8))
    comment = out.add_text("<FHcomment/>", b"##MD")
    out.link(head, 1, out.add(b"##FH", [0, comment], struct.pack("<QhhB3x", stamp, 0, 0, 0)))
    writer, count = _Writer(out), int(out.random.integers(1, 5))
    if out.chance(0.25):
        data_groups = [writer.write_data_group(0, int(out.random.integers(2, 4)))]
    else:
        data_groups = [writer.write_data_group(index, 1) for index in range(count)]
    out.link(head, 0, out.chain(data_groups))
    path.write_bytes(bytes(out.data) + bytes(16 - len(out.data) % 8))
    return writer.known
