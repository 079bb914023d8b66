# SPDX-License-Identifier: MIT
"""Reader of Vector's ASC bus logs: classical frames and CAN FD, numbers hexadecimal or decimal.

Own, because one damaged line must cost one frame and not the rest of the log.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import takewhile

from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.formats.frames import LONGEST, PAYLOAD, Frames, build_frames

_IS_ASC = re.compile(
    rb"^(?:date [A-Z][a-z]{2} |base\s+(?:hex|dec)\b|Begin Triggerblock"
    rb"|[ \t]*\d+\.\d+[ \t]+(?:CANFD[ \t]+)?\d+[ \t]+[0-9A-Fa-f]+x?[ \t]+(?:Rx|Tx)\b)",
    re.MULTILINE | re.IGNORECASE,
)
_HEAD = 4096
"""Bytes in which the base of numbers and the kind of stamps are stated."""
_RELATIVE = re.compile(rb"^base\s+\w+\s+timestamps\s+relative", re.MULTILINE | re.IGNORECASE)
_DECIMAL = re.compile(rb"^base\s+dec\b", re.MULTILINE | re.IGNORECASE)

_WAY = rb"(?:Rx|Tx|TxRq)"
_BYTES = {16: rb"(?:[ \t]+[0-9A-Fa-f]{2})*", 10: rb"(?:[ \t]+\d{1,3})*"}
_START = rb"^[ \t]*(?P<time>\d{1,12}\.\d{1,9})[ \t]+"
_CLASSICAL = (
    rb"(?P<bus>\d{1,3})[ \t]+(?P<id>[0-9A-Fa-f]+)(?P<x>x?)[ \t]+%s[ \t]+d[ \t]+"
    rb"(?P<code>[0-9A-Fa-f]{1,2})(?P<data>%s)"
)
_FLEXIBLE = (
    rb"CANFD[ \t]+(?P<fd_bus>\d{1,3})[ \t]+%s[ \t]+(?P<fd_id>[0-9A-Fa-f]+)(?P<fd_x>x?)[ \t]+"
    rb"(?:[A-Za-z_]\S*[ \t]+)?[01][ \t]+[01][ \t]+[0-9A-Fa-f]{1,2}[ \t]+(?P<length>\d{1,2})"
    rb"(?P<fd_data>%s)"
)
_ANY = re.compile(
    rb"^[ \t]*\S+[ \t]+(?:\d+[ \t]+\S+[ \t]+%s\b|CANFD[ \t]+\d+[ \t]+%s\b|\d+[ \t]+ErrorFrame\b)"
    % (_WAY, _WAY),
    re.MULTILINE,
)
_OTHER = re.compile(
    rb"^[ \t]*\d+\.\d+[ \t]+(?:\d+[ \t]+(?:[0-9A-Fa-f]+x?[ \t]+%s[ \t]+r\b|ErrorFrame\b)"
    rb"|CANFD[ \t]+\d+[ \t]+%s[ \t]+ErrorFrame\b)" % (_WAY, _WAY),
    re.MULTILINE,
)
"""Remote requests and error frames: lines of a sound file that carry no signal."""

_MOST = {False: 0x7FF, True: 0x1FFFFFFF}
"""Largest identifier of a standard and of an extended frame."""

_Row = tuple[float, int, bool, bytes, str]


def is_asc(head: bytes) -> bool:
    """Return True if the first bytes of a file are an ASC log."""
    return _IS_ASC.search(head) is not None


def read_asc(data: bytes, file: str) -> Frames:
    """Read all data frames; damaged lines, remote and error frames are counted in the warnings.

    Raises FileFormatError without a single frame, and where stamps count from the event before, of
    which some may be missing.
    """
    where = Where(file=file)
    if _RELATIVE.search(data[:_HEAD]):
        what = "its time stamps count from event to event"
        raise FileFormatError(what, "export with absolute time stamps", where)
    rows = list(_parse_rows(data, 10 if _DECIMAL.search(data[:_HEAD]) else 16))
    if not rows:
        raise FileFormatError("no frame in the file", "record it again", where)
    other = len(_OTHER.findall(data))
    total = len(_ANY.findall(data))
    warnings = []
    if other:
        warnings.append(f"{other} remote or error frames left out")
    if damaged := total - other - len(rows):
        warnings.append(f"{damaged} damaged lines left out of {total}")
    stamps, identifiers, extended, payloads, buses = zip(*rows, strict=True)
    return build_frames(stamps, identifiers, extended, payloads, buses, tuple(warnings))


def _parse_rows(data: bytes, base: int) -> Iterator[_Row]:
    """Time [s], identifier, whether it is extended, payload and bus of each sound line."""
    part = _BYTES[base]
    line = re.compile(
        _START + b"(?:" + _CLASSICAL % (_WAY, part) + b"|" + _FLEXIBLE % (_WAY, part) + b")",
        re.MULTILINE,
    )
    for match in line.finditer(data):
        time, bus, number, x, code, digits, fd_bus, fd_number, fd_x, fd_length, fd_digits = (
            match.groups()
        )
        if fd_bus is not None:
            bus, number, x, digits, length = fd_bus, fd_number, fd_x, fd_digits, int(fd_length)
        else:
            length = min(_parse_number(code, base), PAYLOAD)
        payload = _parse_payload(digits, base)[:length]
        identifier, extended = _parse_number(number, base), bool(x)
        if len(payload) == length <= LONGEST and 0 <= identifier <= _MOST[extended]:
            yield float(time), identifier, extended, payload, f"channel {int(bus) - 1}"


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
