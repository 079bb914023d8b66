# SPDX-License-Identifier: MIT
"""Reader of bus logs in text format: one frame in each line, found by the patterns of a format.

Own, since a damaged line must cost its frame only. The text readers of python-can 4.6 skip negative
stamps, do not add up relative ones, take payloads shorter than stated, and end at a damaged line.
"""

from __future__ import annotations

import re
from binascii import unhexlify
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from itertools import compress

import numpy as np
from numpy.typing import NDArray

from drivetwin.channels.shiftlog import FloatArray
from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.formats.can.database import (
    FD_LENGTHS,
    LARGEST_IDENTIFIER,
    LONGEST,
    OVERTAKEN,
    PAYLOAD,
    Frames,
    arrange_frames,
    describe_left_out,
    join_frames,
)


@dataclass(frozen=True)
class LineFormat:
    """Lines of a bus log in text format.

    `frame` matches the line of a data frame by these groups; of alternatives, whose names end in a
    digit, the one that takes part counts.

    | group | content |
    |---|---|
    | `time` | stamp: a number in multiples of `tick` [s], or a date |
    | `bus` | number or name of the bus; may be absent |
    | `standard`, `extended` | identifier of 11 or 29 bits, in the `base` of the log |
    | `number`, `wide` | the same in decimal, which comes before the others |
    | `count` | bytes of the payload; may be absent |
    | `code` | index into `lengths`, in `code_base`; may be absent |
    | `data` | bytes of the payload, in the `base` of the log |

    `meant` matches each line meant as a frame, `other` those that carry no signal: remote requests,
    error frames, states of the bus. With `has_cells` a byte may have one digit or three; other
    numbers may follow the payload if `is_open`. `event` matches the stamp of any line of a log
    whose stamps count from event to event. `bare` matches a line without a stamp. Buses count from
    `first_bus`; None if they have names.
    """

    frame: re.Pattern[bytes]
    other: re.Pattern[bytes]
    meant: re.Pattern[bytes]
    tick: float = 1.0
    base: int = 16
    code_base: int = 10
    lengths: Sequence[int] = FD_LENGTHS
    has_cells: bool = False
    is_open: bool = False
    event: re.Pattern[bytes] | None = None
    bare: re.Pattern[bytes] | None = None
    first_bus: int | None = 1
    remedy: str = "record it again"

    def name_bus(self, text: bytes) -> str:
        """Return the name of a bus; a log without buses has one."""
        if self.first_bus is None:
            return text.decode()
        return f"channel {int(text) - self.first_bus if text else 0}"


_BARE_LINES = 200
"""Lines at the start of a log without a frame that may lack stamps [count]."""
_DECIMALS = 9
"""Most decimals of a stamp in seconds."""
_BLOCK = 1 << 22
"""Bytes of a log that are parsed at a time."""
_GAPS = b" \t.,"
"""Signs between the bytes of a payload."""

Columns = Mapping[str, Sequence[bytes]]
"""Texts of each group by its name, one for each frame; absent groups are blank."""


def read_lines(layout: LineFormat, data: bytes, file: str) -> Frames:
    """Read all data frames; damaged lines, remote and error frames are counted in the warnings.

    Stamps that count from event to event are added up over all events of the file. Raises
    FileFormatError without a single frame, and for stamps that are those of no clock.
    """
    events = None if layout.event is None else _add_up_stamps(layout.event, data)
    names: dict[str, int] = {}
    parts = [_read_block(layout, data, span, events, names) for span in _iterate_blocks(data)]
    frames = join_frames(parts, tuple(names))
    count = frames.time.size
    if not count:
        first = data.splitlines()[:_BARE_LINES]
        is_bare = layout.bare is not None and any(map(layout.bare.match, first))
        what = "its lines have no time stamps" if is_bare else "no frame can be read"
        raise FileFormatError(what, layout.remedy, Where(file=file))
    _refuse_steps(frames.time, layout.remedy, file)
    lines = len(layout.meant.findall(data))
    other = 0 if lines == count else len(layout.other.findall(data))
    notes = describe_left_out(lines, other, count)
    if events is not None:
        late = "; after a damaged line they are early" if lines > other + count else ""
        notes = (*notes, f"time stamps from event to event added up{late}")
    return arrange_frames(replace(frames, warnings=notes))


def _iterate_blocks(data: bytes) -> Iterator[tuple[int, int]]:
    """Yield the bounds of blocks of whole lines."""
    start = 0
    while start < len(data):
        end = data.find(b"\n", start + _BLOCK) + 1 or len(data)
        yield start, end
        start = end


def _read_block(
    layout: LineFormat,
    data: bytes,
    span: tuple[int, int],
    events: tuple[NDArray[np.intp], FloatArray] | None,
    names: dict[str, int],
) -> Frames:
    """Return the sound frames between two places; add their buses to `names`."""
    columns = _find_columns(layout.frame, data, span)
    if events is None:
        time = np.array(_parse_stamps(columns["time"], layout.tick), np.float64)
    else:
        places = [match.start() for match in layout.frame.finditer(data, *span)]
        time = events[1][np.searchsorted(events[0], places)]
    identifier, extended = _parse_identifiers(columns, layout.base)
    digits = list(map(_read_cells(layout), columns["data"]))
    held = np.array(list(map(len, digits)), np.intp) // 2
    length = _parse_lengths(columns, layout, held)
    largest = np.where(extended, LARGEST_IDENTIFIER[True], LARGEST_IDENTIFIER[False])
    sound = np.isfinite(time) & (identifier >= 0) & (identifier <= largest) & (length <= LONGEST)
    sound &= held >= length if layout.is_open else held == length
    length = length[sound]
    width = max(PAYLOAD, int(length.max(initial=0)))
    joined = b"".join(
        text[: 2 * width].ljust(2 * width, b"F") for text in compress(digits, sound.tolist())
    )
    table = np.frombuffer(unhexlify(joined), np.uint8).reshape(-1, width)
    if layout.is_open:
        table = np.where(np.arange(width) < length[:, None], table, np.uint8(0xFF))
    texts = list(compress(columns["bus"], sound.tolist()))
    buses = {
        text: names.setdefault(layout.name_bus(text), len(names)) for text in dict.fromkeys(texts)
    }
    return Frames(
        time=time[sound],
        identifier=identifier[sound].astype(np.uint32),
        extended=extended[sound],
        data=table,
        length=length.astype(np.uint8),
        bus=np.array([buses[text] for text in texts], np.intp),
        buses=(),
    )


_GROUPS = ("time", "bus", "standard", "extended", "number", "wide", "count", "code", "data")


def _find_columns(frame: re.Pattern[bytes], data: bytes, span: tuple[int, int]) -> Columns:
    """Return the texts of all groups; those of alternatives are joined."""
    found = frame.findall(data, *span)
    texts = list(zip(*found, strict=True)) or [()] * frame.groups
    columns: dict[str, Sequence[bytes]] = {}
    for name, index in frame.groupindex.items():
        stem, column = name.rstrip("0123456789"), texts[index - 1]
        joined = map(bytes.__add__, columns[stem], column) if stem in columns else column
        columns[stem] = list(joined)
    return {name: columns.get(name) or [b""] * len(found) for name in _GROUPS}


def _parse_stamps(texts: Sequence[bytes], tick: float) -> list[float]:
    """Return the stamps [s]: dates count from 1970, one that does not exist is NaN."""
    try:
        return [tick * float(text) for text in texts]
    except ValueError:
        return [tick * _parse_date(text.replace(b",", b".")) for text in texts]


def _parse_date(text: bytes) -> float:
    if b":" not in text:
        return float(text)
    day, _, seconds = text.rpartition(b":")
    try:
        minute = datetime.fromisoformat(day.decode()).replace(tzinfo=UTC)
    except ValueError:
        return np.nan
    return minute.timestamp() + float(seconds)


def _add_up_stamps(event: re.Pattern[bytes], data: bytes) -> tuple[NDArray[np.intp], FloatArray]:
    """Return place and time [s] of the events of a log whose stamps count between them."""
    found = [(match.start(), match[1]) for match in event.finditer(data)]
    steps = _parse_stamps([text for _, text in found], 1.0)
    return np.array([place for place, _ in found]), np.round(np.cumsum(steps), _DECIMALS)


def _parse_identifiers(columns: Columns, base: int) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the identifiers, -1 for a name without a number, and whether they are extended."""
    texts = map(bytes.__add__, columns["standard"], columns["extended"])
    found = [int(text, base) if text else -1 for text in texts]
    extended = list(map(bool, columns["extended"]))
    if any(columns["number"]) or any(columns["wide"]):
        for row, pair in enumerate(zip(columns["number"], columns["wide"], strict=True)):
            if number := b"".join(pair):
                found[row], extended[row] = int(number), bool(pair[1])
    return np.array(found, np.int64), np.array(extended, np.bool_)


def _parse_lengths(
    columns: Columns, layout: LineFormat, held: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Return the stated bytes of the payloads, those `held` (n,) where a line states none."""
    last = len(layout.lengths) - 1
    stated = {b"": -1, **{text: int(text) for text in set(columns["count"]) if text}}
    coded = {
        text: layout.lengths[min(int(text, layout.code_base), last)] if text else -1
        for text in set(columns["code"])
    }
    counts = np.array([stated[text] for text in columns["count"]], np.intp)
    codes = np.array([coded[text] for text in columns["code"]], np.intp)
    return np.where(counts >= 0, counts, np.where(codes >= 0, codes, held))


def _read_cells(layout: LineFormat) -> Callable[[bytes], bytes]:
    """Return the function from the text of a payload to two hexadecimal digits for each byte.

    A number that exceeds one byte ends the payload.
    """
    if not layout.has_cells:
        return lambda text: text.translate(None, _GAPS)
    base = layout.base

    def read(text: bytes) -> bytes:
        numbers = [int(cell, base) for cell in text.replace(b",", b" ").split()]
        end = next((place for place, one in enumerate(numbers) if one > 0xFF), None)
        return bytes(numbers[:end]).hex().encode()

    return read


_BACKWARD, _ENOUGH = 0.1, 100
"""Share of steps back in time, of so many frames at least, from which stamps may be of no clock."""
_PROGRESS = 5 * OVERTAKEN
"""Time [s] by which the stamps of a clock advance from the first to the second half of a log."""


def _refuse_steps(time: FloatArray, remedy: str, file: str) -> None:
    """Raise FileFormatError for stamps that run back again and again without advancing.

    Frames of several queues run back as often, but by little, and their stamps advance.
    """
    backward = np.count_nonzero(np.diff(time) < 0.0)
    if time.size < _ENOUGH or backward <= _BACKWARD * time.size:
        return
    far = np.count_nonzero(np.maximum.accumulate(time) - time > OVERTAKEN)
    half = time.size // 2
    progress = float(np.median(time[half:]) - np.median(time[:half]))
    if far > _BACKWARD * time.size or progress < _PROGRESS:
        what = "its time stamps run back again and again: they count from frame to frame"
        raise FileFormatError(what, remedy, Where(file=file))
