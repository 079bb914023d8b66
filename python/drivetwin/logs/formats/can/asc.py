# SPDX-License-Identifier: MIT
"""Reader of Vector's ASC bus logs: classical frames and CAN FD, numbers hexadecimal or decimal.

Own, because one damaged line must cost one frame and not the rest of the log.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import takewhile

import numpy as np

from drivetwin.logs.formats.frames import (
    LARGEST_IDENTIFIER,
    LONGEST,
    PAYLOAD,
    FrameRow,
    Frames,
    collect_frames,
)

_STAMP = rb"[-+]?\d{1,12}[.,]\d{1,9}"
_WAY = rb"(?:Rx|Tx|TxRq)"
_FLAGS = re.MULTILINE | re.IGNORECASE
"""Keywords and hexadecimal digits have either case: loggers of other makers write `D` and `rx`."""

_IS_ASC = re.compile(
    rb"^(?:date [A-Z][a-z]{2} |base\s+(?:hex|dec)\b|Begin Triggerblock"
    rb"|[ \t]*%s[ \t]+(?:CANFD[ \t]+\d+[ \t]+%s\b|\d+[ \t]+\S+[ \t]+%s[ \t]+[dr]\b))"
    % (_STAMP, _WAY, _WAY),
    _FLAGS,
)
_HEAD = 65536
"""Bytes in which the base of numbers and the kind of stamps are stated."""
_RELATIVE = re.compile(rb"^base\s+\w+\s+timestamps\s+relative", _FLAGS)
_DECIMAL = re.compile(rb"^base\s+dec\b", _FLAGS)

_BYTES = {16: rb"(?:[ \t]+[0-9A-F]{2}(?![^ \t\r\n]))*", 10: rb"(?:[ \t]+\d{1,3}(?![^ \t\r\n]))*"}
_CLASSICAL = (
    rb"(?P<bus>\d{1,3})[ \t]+(?P<id>[^ \t\r\n]+)[ \t]+%s[ \t]+d[ \t]+"
    rb"(?P<code>[0-9A-F]{1,2})(?P<data>%s)(?:[^\r\n]*[ \t]ID[ \t]*=[ \t]*(?P<number>\d+x?))?"
)
_FLEXIBLE = (
    rb"CANFD[ \t]+(?P<fd_bus>\d{1,3})[ \t]+%s[ \t]+(?P<fd_id>[0-9A-F]+x?)[ \t]+"
    rb"(?:[A-Z_]\S*[ \t]+)?[01][ \t]+[01][ \t]+[0-9A-F]{1,2}[ \t]+(?P<length>\d{1,2})"
    rb"(?P<fd_data>%s)"
)
_EVENT = re.compile(rb"^[ \t]*(%s)[ \t]" % _STAMP, re.MULTILINE)
"""Any line with a stamp: frames and other events, such as statistics."""

_ANY = re.compile(
    rb"^[ \t]*\S+[ \t]+(?:\d+[ \t]+\S+[ \t]+%s\b|CANFD[ \t]+\d+[ \t]+%s\b|\d+[ \t]+ErrorFrame\b)"
    % (_WAY, _WAY),
    _FLAGS,
)
_OTHER = re.compile(
    rb"^[ \t]*%s[ \t]+(?:\d+[ \t]+(?:\S+[ \t]+%s[ \t]+r\b|ErrorFrame\b)"
    rb"|CANFD[ \t]+\d+[ \t]+%s[ \t]+ErrorFrame\b)" % (_STAMP, _WAY, _WAY),
    _FLAGS,
)
"""Remote requests and error frames: lines of a sound file that carry no signal."""

_HEXADECIMAL = re.compile(rb"[0-9A-Fa-f]+")
_DECIMALS = 9
"""Most decimals of a stamp in seconds."""


def is_asc(head: bytes) -> bool:
    """Return True if the first bytes of a file are an ASC log."""
    return _IS_ASC.search(head) is not None


def read_asc(data: bytes, file: str) -> Frames:
    """Read all data frames; damaged lines, remote and error frames are counted in the warnings.

    Stamps that count from event to event are added up over all events of the file. Raises
    FileFormatError without a single frame.
    """
    head = data[:_HEAD]
    places, rows = [], []
    for place, row in _parse_rows(data, 10 if _DECIMAL.search(head) else 16):
        places.append(place)
        rows.append(row)
    lines, other = len(_ANY.findall(data)), len(_OTHER.findall(data))
    notes = []
    if rows and _RELATIVE.search(head):
        stamps = _add_up_stamps(data, places)
        rows = [(stamp, *row[1:]) for stamp, row in zip(stamps, rows, strict=True)]
        note = "time stamps from event to event added up"
        is_damaged = lines > other + len(rows)
        notes.append(f"{note}; after a damaged line they are early" if is_damaged else note)
    return collect_frames(rows, file, lines=lines, other=other, notes=tuple(notes))


def _add_up_stamps(data: bytes, places: Sequence[int]) -> tuple[float, ...]:
    """Return the time [s] of the lines at `places` of a file whose stamps count between events."""
    events = [(match.start(), _parse_stamp(match[1])) for match in _EVENT.finditer(data)]
    starts, steps = zip(*events, strict=True)
    time = np.round(np.cumsum(steps), _DECIMALS)
    return tuple(time[np.searchsorted(starts, places)].tolist())


def _parse_rows(data: bytes, base: int) -> Iterator[tuple[int, FrameRow]]:
    """Yield the place of each sound line and its frame."""
    part = _BYTES[base]
    line = re.compile(
        b"^[ \t]*(?P<time>" + _STAMP + b")[ \t]+(?:"
        + _CLASSICAL % (_WAY, part) + b"|" + _FLEXIBLE % (_WAY, part) + b")",
        _FLAGS,
    )  # fmt: skip
    for match in line.finditer(data):
        time, bus, name, code, digits, number, fd_bus, fd_name, fd_length, fd_digits = (
            match.groups()
        )
        if fd_bus is not None:
            bus, name, digits, length = fd_bus, fd_name, fd_digits, int(fd_length)
        else:
            length = min(_parse_number(code, base), PAYLOAD)
        payload = _parse_payload(digits, base)[:length]
        identifier, extended = _parse_identifier(name, number, base)
        if len(payload) == length <= LONGEST and 0 <= identifier <= LARGEST_IDENTIFIER[extended]:
            bus_name = f"channel {int(bus) - 1}"
            yield match.start(), (_parse_stamp(time), identifier, extended, payload, bus_name)


def _parse_stamp(text: bytes) -> float:
    return float(text.replace(b",", b"."))


def _parse_identifier(name: bytes, number: bytes | None, base: int) -> tuple[int, bool]:
    """Return the identifier and whether it is extended; -1 for a name without a number.

    The decimal `number` at the end of a line is the identifier where the name is symbolic.
    """
    text, base = (name, base) if number is None else (number, 10)
    digits = text[:-1] if text[-1:] in b"xX" else text
    is_number = (digits.isdigit() if base == 10 else _HEXADECIMAL.fullmatch(digits)) and digits
    return int(digits, base) if is_number else -1, len(digits) < len(text)


def _parse_payload(digits: bytes, base: int) -> bytes:
    """Parse the payload bytes; stop before the first number that exceeds one byte."""
    if base == 16:
        return bytes.fromhex(digits.decode())
    numbers = [int(one) for one in digits.split()]
    whole = list(takewhile(lambda one: one < 256, numbers))
    return bytes(whole)


def _parse_number(digits: bytes, base: int) -> int:
    """Parse a number; -1 if a decimal log contains letters."""
    return -1 if base == 10 and not digits.isdigit() else int(digits, base)
