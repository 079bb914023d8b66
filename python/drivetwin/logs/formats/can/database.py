# SPDX-License-Identifier: MIT
"""Frames of a bus log as arrays, and databases (DBC) by which signals become numbers.

Databases are read by cantools, whole columns at a time. The messages of engine and gearbox are
built in and need no library.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.atomic import LARGEST_RECORD, measure_regular_file
from drivetwin._util.optional_dependencies import handle_parser_errors, import_extra
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.errors import FileFormatError
from drivetwin.logs.formats.cell_text import CodeValues, interpret_codes
from drivetwin.logs.raw import describe_origin, find_origin, subtract_origin


@dataclass(frozen=True)
class Signal:
    """One signal of a message: value = `scale`·code + `offset` in `unit`.

    `start` is the bit as a DBC counts it (least significant bit for Intel, most significant for
    Motorola order). `limits` are the least and greatest value that is one, None where the database
    states none. `selector` is the code of the multiplexer (start, length) that admits the signal.
    `spn` is its SAE J1939 number. `texts` are the codes that the database names.
    """

    name: str
    start: int
    length: int
    intel: bool = True
    signed: bool = False
    is_float: bool = False
    scale: float = 1.0
    offset: float = 0.0
    unit: str | None = None
    limits: tuple[float, float] | None = None
    selector: tuple[Signal, frozenset[int]] | None = None
    spn: int | None = None
    texts: tuple[tuple[int, str], ...] = ()

    @property
    def end(self) -> int:
        """Number of bytes that a frame must have to hold the signal."""
        if self.intel:
            return (self.start + self.length + 7) // 8
        return self.start // 8 + (7 - self.start % 8 + self.length + 7) // 8


@dataclass(frozen=True)
class Message:
    """A message: `identifier` of 11 bits, or 29 if `extended`; `j1939`: only its group counts."""

    name: str
    identifier: int
    extended: bool
    j1939: bool
    signals: tuple[Signal, ...]


PAYLOAD, LONGEST = 8, 64
"""Most data bytes of a classical frame, and of one of CAN FD."""

EXTENDED_BIT = 1 << 31
"""Bit of an identifier by which files mark 29 bits."""

LARGEST_IDENTIFIER = {False: 0x7FF, True: 0x1FFFFFFF}
"""Largest identifier of a standard and of an extended frame."""

FD_LENGTHS = (*range(9), 12, 16, 20, 24, 32, 48, 64)
"""Data bytes by the length code of CAN FD."""


@dataclass(frozen=True, eq=False)
class Frames:
    """Data frames of a log; those far too early are in file order, the others in order of time.

    `time` (n,) [s]; `identifier` (n,) has 29 bits where `extended` (n,) is true, else 11; `data`
    (n, width) is padded with 0xFF, as wide as the longest and at least 8; `length` (n,) is the
    number of valid bytes; `bus` (n,) is an index into `buses`.
    """

    time: FloatArray
    identifier: NDArray[np.uint32]
    extended: NDArray[np.bool_]
    data: NDArray[np.uint8]
    length: NDArray[np.uint8]
    bus: NDArray[np.intp]
    buses: tuple[str, ...]
    warnings: tuple[str, ...] = field(default=())


def build_frames(
    stamps: Sequence[float],
    identifiers: Sequence[int],
    extended: Sequence[bool],
    payloads: Sequence[bytes],
    buses: Sequence[str],
    warnings: tuple[str, ...] = (),
) -> Frames:
    """Build the table from one entry for each frame; payloads have at most LONGEST bytes."""
    names = tuple(dict.fromkeys(buses))
    index = {name: place for place, name in enumerate(names)}
    width = max(PAYLOAD, max(map(len, payloads), default=0))
    padded = b"".join(payload.ljust(width, b"\xff") for payload in payloads)
    frames = Frames(
        time=np.array(stamps, np.float64),
        identifier=np.array(identifiers, np.uint32),
        extended=np.array(extended, np.bool_),
        data=np.frombuffer(padded, np.uint8).reshape(-1, width),
        length=np.array([len(payload) for payload in payloads], np.uint8),
        bus=np.array([index[name] for name in buses], np.intp),
        buses=names,
        warnings=warnings,
    )
    return arrange_frames(frames)


def join_frames(parts: Sequence[Frames], buses: tuple[str, ...]) -> Frames:
    """Join tables whose `bus` is an index into `buses`."""
    width = max((part.data.shape[1] for part in parts), default=PAYLOAD)
    data = [
        np.pad(part.data, ((0, 0), (0, width - part.data.shape[1])), constant_values=0xFF)
        if part.data.shape[1] < width
        else part.data
        for part in parts
    ]
    return Frames(
        time=np.concatenate([part.time for part in parts]),
        identifier=np.concatenate([part.identifier for part in parts]),
        extended=np.concatenate([part.extended for part in parts]),
        data=np.concatenate(data),
        length=np.concatenate([part.length for part in parts]),
        bus=np.concatenate([part.bus for part in parts]),
        buses=buses,
    )


def arrange_frames(frames: Frames) -> Frames:
    """Sort frames that others of their bus overtook; count time from the origin.

    The warnings of the table come first.
    """
    order, remarks = _sort_overtaken(frames.time, frames.bus)
    origin = find_origin(frames.time[:1])
    warnings = (*frames.warnings, *remarks, *describe_origin(origin))
    time = subtract_origin(frames.time, origin)
    if order is None:
        return replace(frames, time=time, warnings=warnings)
    return Frames(
        time=time[order],
        identifier=frames.identifier[order],
        extended=frames.extended[order],
        data=frames.data[order],
        length=frames.length[order],
        bus=frames.bus[order],
        buses=frames.buses,
        warnings=warnings,
    )


OVERTAKEN = 0.02
"""Time [s] by which a frame may be stamped before an earlier one of its bus: queues of a logger,
order of interrupts."""
_STAMP_DECIMALS = 6
"""Decimals [s] that the stamp of a clock from 1970 on can hold."""
MOST_EARLIER, FEW_EARLIER = 0.01, 3
"""Share of frames that may be stamped still earlier, and how many of a short log [count]."""


def _sort_overtaken(
    time: FloatArray, bus: NDArray[np.intp]
) -> tuple[NDArray[np.intp] | None, tuple[str, ...]]:
    """Return the order of frames by `time` (n,) [s] on each bus, and a remark; None if in order.

    Frames that are stamped earlier by more than `OVERTAKEN` keep their place. With many of them a
    bus stays as it is: its clock was set, and it is open which stamps are right.
    """
    if np.all(time[1:] >= time[:-1]):
        return None, ()
    order, count, most = np.arange(time.size), 0, 0.0
    for one in np.unique(bus):
        rows = np.flatnonzero(bus == one)
        latest = np.maximum.accumulate(time[rows])
        late = np.round(latest - time[rows], _STAMP_DECIMALS)
        is_far = late > OVERTAKEN
        is_moved = (late > 0.0) & ~is_far
        if is_moved.any() and is_far.sum() <= max(FEW_EARLIER, MOST_EARLIER * rows.size):
            key = np.where(is_far, latest, time[rows])
            order[rows] = rows[np.argsort(key, kind="stable")]
            count += int(is_moved.sum())
            most = max(most, 1e3 * float(late[is_moved].max()))
    if not count:
        return None, ()
    return order, (f"{count} frames out of order by up to {most:.3g} ms sorted by their stamps",)


def describe_left_out(lines: int, other: int, count: int) -> tuple[str, ...]:
    """Count what was left out of `lines` meant as frames: `other` frames, and damaged lines.

    `count` frames were read.
    """
    notes = (f"{other} remote or error frames left out",) if other else ()
    damaged = lines - other - count
    return (*notes, f"{damaged} damaged lines left out of {lines}") if damaged else notes


Bytes = NDArray[np.uint8]
_MOST_BITS = 56
"""Longer integers do not fit float64 exactly and carry no physical quantity."""


def read_database(paths: Sequence[Path]) -> tuple[Message, ...]:
    """Read DBC files.

    Raises MissingExtraError without cantools, FileFormatError for what is no DBC.
    """
    messages: list[Message] = []
    for path in paths:
        import_extra("cantools.database", "can", "decoding a bus log", path)
        measure_regular_file(path, FileFormatError, "correct dbc under [bus]", LARGEST_RECORD)
        with handle_parser_errors("a DBC file", path):
            messages += parse_database(path.read_bytes(), path)
    return tuple(messages)


def parse_database(data: bytes, path: Path) -> list[Message]:
    """Parse the bytes of a DBC file that errors name `path`; raises as `read_database`."""
    cantools = import_extra("cantools.database", "can", "decoding a bus log", path)
    with handle_parser_errors("a DBC file", path):
        content = cantools.load_string(_decode_text(data), "dbc", strict=False)
        return [_convert_message(one) for one in content.messages]


def _decode_text(data: bytes) -> str:
    """Text of a database: UTF-8 with or without a mark, or cp1252, as older tools write it."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def list_databases(log: Path) -> list[str]:
    """List the names of the DBC files beside a log."""
    return sorted(one.name for one in log.parent.glob("*") if one.suffix.casefold() == ".dbc")


def _convert_message(source: Any) -> Message:
    by_name = {one.name: one for one in source.signals}
    return Message(
        name=source.name,
        identifier=int(source.frame_id),
        extended=bool(source.is_extended_frame),
        j1939=source.protocol == "j1939",
        signals=tuple(_convert_signal(one, by_name) for one in source.signals),
    )


def _convert_signal(source: Any, by_name: dict[str, Any]) -> Signal:
    selector = None
    if source.multiplexer_ids and source.multiplexer_signal in by_name:
        switch = _convert_signal(by_name[source.multiplexer_signal], by_name)
        selector = (switch, frozenset(int(each) for each in source.multiplexer_ids))
    low, high = source.minimum, source.maximum
    stated = low is not None and high is not None and low < high
    return Signal(
        name=source.name,
        start=int(source.start),
        length=int(source.length),
        intel=source.byte_order == "little_endian",
        signed=bool(source.is_signed),
        is_float=bool(source.is_float),
        scale=float(source.scale),
        offset=float(source.offset),
        unit=source.unit or None,
        limits=(float(low), float(high)) if stated else None,
        selector=selector,
        spn=source.spn,
        texts=tuple((int(code), str(text)) for code, text in (source.choices or {}).items()),
    )


def decode_codes(data: Bytes, signal: Signal) -> NDArray[np.int64]:
    """Return the unsigned codes (n,) of a signal in payloads `data` (n, bytes).

    Raises ValueError where the signal is too long or does not fit the payloads.
    """
    if signal.length > _MOST_BITS or signal.end > data.shape[1]:
        raise ValueError(f"{signal.name} has {signal.length} bits, ends in byte {signal.end}")
    first, last = signal.start // 8, signal.end
    total = np.zeros(len(data), np.uint64)
    if signal.intel:
        for place in range(last - 1, first - 1, -1):
            total = (total << np.uint64(8)) | data[:, place].astype(np.uint64)
        total >>= np.uint64(signal.start % 8)
    else:
        for place in range(first, last):
            total = (total << np.uint64(8)) | data[:, place].astype(np.uint64)
        total >>= np.uint64(8 * (last - first) - (7 - signal.start % 8) - signal.length)
    return (total & np.uint64((1 << signal.length) - 1)).astype(np.int64)


def decode_physical(data: Bytes, signal: Signal) -> FloatArray:
    """Return the values (n,) of a signal in its unit; ValueError as in `decode_codes`.

    Texts of the database that are numbers are the values of their codes, NaN where others beside
    them are none. A code whose text is a fault has no value: NaN.
    """
    if signal.is_float:
        raw = _decode_floats(data, signal)
    else:
        codes = decode_codes(data, signal)
        negative = signal.signed & (codes >> (signal.length - 1))
        raw = (codes - (negative << signal.length)).astype(np.float64)
    values = signal.scale * raw + signal.offset
    if signal.texts:
        place, named = find_named_codes(data, signal), _interpret_texts(signal)
        values = np.where(place < 0, values, named.values[place])
    return values


def find_named_codes(data: Bytes, signal: Signal) -> NDArray[np.intp]:
    """Return the place (n,) of each code among the texts of a signal, -1 for codes without one.

    A database may state the code of a negative number with or without its sign.
    """
    wanted = [code for code, _ in signal.texts]
    if signal.is_float:
        raw: NDArray[Any] = _decode_floats(data, signal)
    else:
        raw = decode_codes(data, signal)
        wanted = [code & ((1 << signal.length) - 1) for code in wanted]
    place = np.full(len(data), -1, np.intp)
    for number, code in enumerate(wanted):
        place[raw == code] = number
    return place


def find_faults(data: Bytes, signal: Signal) -> NDArray[np.intp]:
    """Return, as `find_named_codes`, the places of the texts that are faults alone."""
    place = find_named_codes(data, signal)
    return np.where(_interpret_texts(signal).faults[place], place, -1) if signal.texts else place


@cache
def _interpret_texts(signal: Signal) -> CodeValues:
    codes = np.array([code for code, _ in signal.texts], np.float64)
    if signal.signed and not signal.is_float:
        codes = np.where(codes >= 1 << (signal.length - 1), codes - (1 << signal.length), codes)
    return interpret_codes([text for _, text in signal.texts], signal.scale * codes + signal.offset)


def _decode_floats(data: Bytes, signal: Signal) -> FloatArray:
    """IEEE numbers that start on a byte border."""
    width = signal.length // 8
    first = signal.start // 8
    aligned = signal.start % 8 == (0 if signal.intel else 7)
    if not aligned or width not in (4, 8) or first + width > data.shape[1]:
        raise ValueError(f"{signal.name} is a number of {signal.length} bits inside bytes")
    kind = np.dtype(f"{'<' if signal.intel else '>'}f{width}")
    part = np.ascontiguousarray(data[:, first : first + width])
    return part.view(kind)[:, 0].astype(np.float64)


def select_valid_payloads(
    data: Bytes, length: NDArray[np.uint8] | NDArray[np.intp], signal: Signal
) -> NDArray[np.bool_]:
    """Select the payloads (n,) that are long enough and whose multiplexer selects the signal.

    A multiplexer may itself be multiplexed; then only some payloads contain it.
    """
    return np.asarray(length >= signal.end) & select_addressed_payloads(data, length, signal)


def select_addressed_payloads(
    data: Bytes, length: NDArray[np.uint8] | NDArray[np.intp], signal: Signal
) -> NDArray[np.bool_]:
    """Select the payloads (n,) whose multiplexer selects the signal, of any length."""
    if signal.selector is None:
        return np.ones(len(data), np.bool_)
    switch, allowed = signal.selector
    chosen = np.isin(decode_codes(data, switch), list(allowed))
    return chosen & select_valid_payloads(data, length, switch)


_MESSAGE = re.compile(r"^BO_ (?P<identifier>\d+) (?P<name>\w+):")
_SIGNAL = re.compile(
    r"^ SG_ (?P<name>\w+) : (?P<start>\d+)\|(?P<length>\d+)@1\+ "
    r"\((?P<scale>[^,]+),(?P<offset>[^)]+)\) \[(?P<low>[^|]+)\|(?P<high>[^\]]+)\] "
    r'"(?P<unit>[^"]*)"'
)
_NUMBER = re.compile(r'^BA_ "SPN" SG_ (?P<identifier>\d+) (?P<name>\w+) (?P<spn>\d+);')


@cache
def load_driveline_messages() -> tuple[Message, ...]:
    """Load the messages of `driveline.dbc`: J1939, Intel order, unsigned, not multiplexed."""
    text = (files("drivetwin.logs.formats.can") / "driveline.dbc").read_text(encoding="utf-8")
    numbers: dict[tuple[str, str], int] = {}
    found: dict[str, list[re.Match[str]]] = {}
    names: dict[str, str] = {}
    identifier = ""
    for line in text.splitlines():
        if message := _MESSAGE.match(line):
            identifier = message["identifier"]
            found[identifier], names[identifier] = [], message["name"]
        elif signal := _SIGNAL.match(line):
            found[identifier].append(signal)
        elif number := _NUMBER.match(line):
            numbers[number["identifier"], number["name"]] = int(number["spn"])
    return tuple(
        Message(
            name=names[one],
            identifier=int(one) & ~EXTENDED_BIT,
            extended=True,
            j1939=True,
            signals=tuple(
                _build_signal(each, numbers.get((one, each["name"]))) for each in signals
            ),
        )
        for one, signals in found.items()
    )


def _build_signal(match: re.Match[str], spn: int | None) -> Signal:
    return Signal(
        name=match["name"],
        start=int(match["start"]),
        length=int(match["length"]),
        scale=float(match["scale"]),
        offset=float(match["offset"]),
        unit=match["unit"] or None,
        limits=(float(match["low"]), float(match["high"])),
        spn=spn,
    )
