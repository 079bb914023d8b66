# SPDX-License-Identifier: MIT
"""Blocks of MDF files: check of their chains, and conversions of raw samples.

Blocks of MDF 4 point at each other by file position. One flipped bit makes a chain end outside the
file or run in a circle, on which a trusting parser fails late, never ends, or asks for endless
memory. Chains are walked before asammdf follows them.

Conversions of MDF 3 and 4 take raw samples to float64, then to physical values. asammdf computes in
the type of the raw samples: integers overflow, float16 loses digits, and value ranges of integers
are open at their end. It is used here for the parsed conversion alone.
"""

from __future__ import annotations

import mmap
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.optional_dependencies import import_extra
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.formats.cell_text import describe_faults, interpret_codes, parse_numbers

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


_LISTED = 8
"""Largest number of texts of a table that are listed."""

_FORMULA3, _TABLES3 = 10, (11, 12)
"""Kinds of conversions of MDF 3: a formula; a table of texts, or of ranges with texts."""

_TABLES = (7, 8)
"""Kinds of conversions of MDF 4: from values to texts, from ranges to texts."""

_TEXT_TO_TEXT, _BITS = (9, 10), 11
"""Kinds of MDF 4: from texts, to numbers or texts; bits with a text each."""


class ConversionError(ValueError):
    """A conversion that cannot be evaluated; the text is the cause."""


@dataclass(frozen=True, eq=False)
class Converted:
    """Physical values (n,), NaN without one; `left_out` (n,) marks faults, None: there are none."""

    values: FloatArray
    left_out: NDArray[np.bool_] | None = None
    notes: tuple[str, ...] = ()


def convert_samples(raw: NDArray[Any], conversion: Any, path: Path) -> Converted:
    """Convert the raw numbers (n,) of a channel by a conversion of asammdf, None without any.

    A fault is no sample, and another text among numbers is NaN. Texts that are numbers are the
    values. If no text is a number, the codes are, and a note lists the texts. Raises
    ConversionError, and MissingExtraError for a formula without numexpr.
    """
    if conversion is None or (_is_version4(conversion) and conversion.conversion_type == _BITS):
        return Converted(np.asarray(raw, np.float64))
    if not _has_texts(conversion):
        return Converted(convert_numbers(raw, conversion, path))
    known, place, counts = np.unique(raw, return_inverse=True, return_counts=True)
    looked = look_up_codes(conversion, known, path)
    return _choose_values(looked, known, place, counts, conversion)


def convert_texts(texts: NDArray[Any], samples: NDArray[Any]) -> Converted | None:
    """Convert `samples` (n,) of a channel that records `texts` (n,); None without a number.

    Samples that are numbers come from a table of the file; else the texts are the numbers.
    """
    listed, place, counts = np.unique(texts, return_inverse=True, return_counts=True)
    names = [decode_text(one) for one in listed.tolist()]
    found = interpret_codes(names, np.full(len(names), np.nan))
    values = samples.astype(np.float64) if samples.dtype.kind in "iufb" else None
    if values is None and not found.chosen:
        return None
    notes = [describe_faults(names, np.where(found.faults, counts, 0).tolist(), texts.size)]
    notes.append(found.note if values is None else "")
    return Converted(
        found.values[place] if values is None else values,
        found.faults[place],
        tuple(filter(None, notes)),
    )


@dataclass(frozen=True, eq=False)
class LookedUp:
    """Text of each code (k,), None for a number, and the number (k,), NaN for a text."""

    texts: list[str | None]
    numbers: FloatArray
    is_text: NDArray[np.bool_] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "is_text", np.array([one is not None for one in self.texts], bool))


def _choose_values(
    looked: LookedUp, known: NDArray[Any], place: Any, counts: Any, conversion: Any
) -> Converted:
    """Return the value of each sample by the `looked` up meaning of the `known` codes."""
    named = np.flatnonzero(looked.is_text)
    texts = [looked.texts[index] or "" for index in named.tolist()]
    found = interpret_codes(texts, known[named].astype(np.float64))
    values, note = looked.numbers.copy(), found.note
    if _has_numbers(conversion):
        values[named] = np.where(found.faults, np.nan, parse_numbers(texts))
        note = ""
    elif not found.chosen:
        note = _describe_codes(conversion)
        values[named] = found.values
    else:
        values[named] = found.values
    faults = np.zeros(known.size, np.bool_)
    faults[named] = found.faults
    lost = np.where(found.faults, counts[named], 0).tolist()
    notes = (note, describe_faults(texts, lost, int(counts.sum())))
    return Converted(values[place], faults[place], tuple(filter(None, notes)))


def convert_numbers(raw: NDArray[Any], conversion: Any, path: Path) -> FloatArray:
    """Return the physical values (n,) by a conversion without texts, None for none."""
    values = np.asarray(raw, np.float64)
    if conversion is None:
        return values
    if formula := getattr(conversion, "formula", ""):
        return _evaluate_formula(formula, values, path)
    with np.errstate(all="ignore"):
        if not _is_version4(conversion):
            return np.asarray(conversion.convert(values), np.float64)
        kind = int(conversion.conversion_type)
        if kind not in _NUMERIC:
            raise ConversionError(f"its conversion is of kind {kind}, which is none of numbers")
        return _NUMERIC[kind](values, conversion, raw.dtype.kind != "f")


def scale_linear(values: FloatArray, scale: float, shift: float) -> FloatArray:
    """Return `scale` times the values (n,) plus `shift`."""
    return values if (scale, shift) == (1.0, 0.0) else values * scale + shift


def _convert_linear(values: FloatArray, conversion: Any, _: bool) -> FloatArray:
    return scale_linear(values, float(conversion.a), float(conversion.b))


def _convert_rational(values: FloatArray, conversion: Any, _: bool) -> FloatArray:
    p = [float(getattr(conversion, f"P{number}")) for number in range(1, 7)]
    above = (p[0] * values + p[1]) * values + p[2]
    below = (p[3] * values + p[4]) * values + p[5]
    result: FloatArray = above / below
    return result


def _read_table(conversion: Any) -> tuple[FloatArray, FloatArray]:
    count = int(conversion.val_param_nr) // 2
    keys, values = (
        np.array([getattr(conversion, f"{name}_{index}") for index in range(count)], np.float64)
        for name in ("raw", "phys")
    )
    if not count or not np.all(np.diff(keys) > 0.0):
        raise ConversionError("the keys of its conversion table do not increase")
    return keys, values


def _interpolate(values: FloatArray, conversion: Any, _: bool) -> FloatArray:
    return np.asarray(np.interp(values, *_read_table(conversion)))


def _take_nearest(values: FloatArray, conversion: Any, _: bool) -> FloatArray:
    """Values of the nearest keys; of two keys as near, the lower one's."""
    keys, physical = _read_table(conversion)
    upper = np.searchsorted(keys, values).clip(1, max(keys.size - 1, 1))
    lower, upper = upper - 1, upper.clip(max=keys.size - 1)
    nearest = np.where(values - keys[lower] <= keys[upper] - values, lower, upper)
    return np.where(np.isnan(values), np.nan, physical[nearest])


def _convert_ranges(values: FloatArray, conversion: Any, is_integer: bool) -> FloatArray:
    """Values of the first range that holds a number; the default without any."""
    count = int(conversion.val_param_nr)
    result = np.full(values.shape, conversion.default if count % 3 == 1 else np.nan, np.float64)
    free = np.ones(values.shape, np.bool_)
    for index in range(count // 3):
        low, high, physical = (
            getattr(conversion, f"{name}_{index}") for name in ("lower", "upper", "phys")
        )
        inside = free & _is_inside(values, low, high, is_integer)
        result[inside] = physical
        free &= ~inside
    return result


def _is_inside(values: NDArray[Any], low: float, high: float, is_integer: bool) -> Any:
    """Ranges of integers include their end, those of other numbers do not."""
    below = values <= high if is_integer else (values < high) | (values == low)
    return (values >= low) & below


_NUMERIC: dict[int, Callable[[FloatArray, Any, bool], FloatArray]] = {
    0: lambda values, _, __: values,
    1: _convert_linear,
    2: _convert_rational,
    4: _interpolate,
    5: _take_nearest,
    6: _convert_ranges,
}
"""Functions by the kind of a conversion of MDF 4."""


def _evaluate_formula(formula: str, values: FloatArray, path: Path) -> FloatArray:
    """Return the values (n,) of a formula over the raw ones `X`, also named `X1`."""
    numexpr = import_extra("numexpr", "mdf", "an MDF file", path)
    try:
        names = {"X": values, "X1": values, "INF": np.inf, "NaN": np.nan}
        found = numexpr.evaluate(formula, names, {}, sanitize=True)
        return np.broadcast_to(np.asarray(found, np.float64), values.shape)
    except Exception:
        raise ConversionError(f"its formula {formula!r} is none that can be evaluated") from None


def _is_version4(conversion: Any) -> bool:
    return hasattr(conversion, "val_param_nr")


def _has_texts(conversion: Any) -> bool:
    """Return True if a conversion gives texts for codes."""
    kind = conversion.conversion_type
    return kind in (_TABLES if _is_version4(conversion) else _TABLES3)


def _list_blocks(conversion: Any) -> dict[str, Any]:
    """Texts and conversions to which a table refers."""
    found: dict[str, Any] = getattr(conversion, "referenced_blocks", None) or {}
    return found


def _has_numbers(conversion: Any) -> bool:
    """Return True if a table of texts has numbers too."""
    blocks = _list_blocks(conversion)
    default = blocks.get("default_addr")
    return any(hasattr(block, "convert") for block in blocks.values()) or _is_formula3(default)


def _is_formula3(default: Any) -> bool:
    """Return True for a default of MDF 3 that is a formula as text."""
    return isinstance(default, bytes) and b"{X}" in default


def look_up_codes(conversion: Any, codes: NDArray[Any], path: Path) -> LookedUp:
    """Look up codes (k,) in the table of a conversion; of an unsorted one asammdf finds few."""
    blocks = _list_blocks(conversion)
    texts: list[str | None] = [None] * codes.size
    numbers = np.full(codes.size, np.nan)
    free = np.ones(codes.size, np.bool_)

    def fill(inside: NDArray[np.bool_], meaning: Any) -> None:
        free[inside] = False
        if hasattr(meaning, "convert"):
            part = codes[inside]
            if not _has_texts(meaning):
                numbers[inside] = convert_numbers(part, meaning, path)
                return
            nested = look_up_codes(meaning, part, path)
            numbers[inside] = nested.numbers
            for place, named in zip(np.flatnonzero(inside).tolist(), nested.texts, strict=True):
                texts[place] = named
        else:
            for place in np.flatnonzero(inside).tolist():
                texts[place] = decode_text(meaning or b"")

    is_integer = codes.dtype.kind != "f"
    for number in range(max(len(blocks), getattr(conversion, "ref_param_nr", 0))):
        text = blocks.get(f"text_{number}", getattr(conversion, f"text_{number}", None))
        value = getattr(conversion, f"val_{number}", None)
        value = getattr(conversion, f"param_val_{number}", value)
        low, high = (getattr(conversion, f"{end}_{number}", value) for end in ("lower", "upper"))
        if text is not None and low is not None and high is not None:
            fill(free & _is_inside(codes, low, high, is_integer), text)
    default = blocks.get("default_addr", b"")
    if _is_formula3(default):
        numbers[free] = np.asarray(conversion.convert(codes.astype(np.float64)), np.float64)[free]
    else:
        fill(free.copy(), default)
    return LookedUp(texts, numbers)


def decode_text(text: Any) -> str:
    """Return a text of a file without the zeros at its end."""
    return text.decode("utf-8", "replace").strip("\0") if isinstance(text, bytes) else str(text)


def _describe_codes(conversion: Any) -> str:
    """Words for a table of texts: `codes of texts: 0 = off, 1 = on`."""
    blocks = _list_blocks(conversion)
    pairs = []
    for index in range(_LISTED):
        text = blocks.get(f"text_{index}")
        code = getattr(conversion, f"val_{index}", getattr(conversion, f"lower_{index}", None))
        if isinstance(text, bytes) and code is not None:
            pairs.append(f"{code:g} = {decode_text(text)}")
    return f"codes of texts: {', '.join(pairs)}" if pairs else ""
