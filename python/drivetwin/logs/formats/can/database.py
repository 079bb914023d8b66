# SPDX-License-Identifier: MIT
"""Databases (DBC), read by cantools, and their signals as numbers, whole columns at a time.

The messages of engine and gearbox are built in and need no library.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Sequence
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
from drivetwin.logs.formats.code_texts import CodeValues, interpret_codes
from drivetwin.logs.formats.frames import EXTENDED_BIT, Message, Signal

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
