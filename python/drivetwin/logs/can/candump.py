# SPDX-License-Identifier: MIT
"""Reader of candump text: the human-readable form, and the compact one of `candump -L`."""

from __future__ import annotations

import re

from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.can.frames import LONGEST, Frames, frame_table

_LINE = re.compile(
    rb"^[ \t]*\((?P<time>\d{1,12}\.\d{1,9})\)[ \t]+(?P<bus>[\w.:-]+)[ \t]+"
    rb"(?:(?:RX|TX|[-BE]{2})[ \t]+(?:[-BE]{2}[ \t]+)?)?(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})"
    rb"(?:[ \t]+\[(?P<count>\d{1,2})\](?P<spaced>(?:[ \t]+[0-9A-Fa-f]{2})*)"
    rb"|#(?P<packed>(?:#[0-9A-Fa-f])?(?:[0-9A-Fa-f]{2}\.?)*))"
    rb"(?:[ \t]+(?:'[^\n]*|[RT]))?[ \t]*\r?$",
    re.MULTILINE,
)
_OTHER = re.compile(rb"^[ \t]*\(\d{1,12}\.\d{1,9}\)[ \t]+[\w.:-]+[ \t]+[0-9A-Fa-f]{3,8}"
                    rb"(?:[ \t]+\[\d+\][ \t]+(?:remote request|ERRORFRAME)|#R\d?\b)",
                    re.MULTILINE)  # fmt: skip
"""Remote requests and error frames: lines of a sound file that carry no signal."""


def is_candump(head: bytes) -> bool:
    """Tell whether the first bytes of a file are candump text."""
    lines = [line for line in head.splitlines()[:60] if line.strip()]
    fitting = sum(_LINE.match(line) is not None or _OTHER.match(line) is not None for line in lines)
    return fitting > 0 and fitting >= len(lines) // 2


def read_candump(data: bytes, file: str) -> Frames:
    """Read all data frames; lines that are none are counted in the warnings.

    Raises FileFormatError without a single frame.
    """
    stamps: list[float] = []
    identifiers: list[int] = []
    extended: list[bool] = []
    payloads: list[bytes] = []
    buses: list[str] = []
    for match in _LINE.finditer(data):
        stamp, bus, identifier, count, spaced, packed = match.groups()
        digits = _without_flags(packed) if spaced is None else spaced
        payload = bytes.fromhex(digits.replace(b".", b"").decode())
        if len(payload) > LONGEST or (count is not None and int(count) != len(payload)):
            continue
        stamps.append(float(stamp))
        identifiers.append(int(identifier, 16))
        extended.append(len(identifier) == 8)
        payloads.append(payload)
        buses.append(bus.decode())
    if not stamps:
        raise FileFormatError(
            "no frame can be read", "record the bus with `candump -L`", Where(file=file)
        )
    other = len(_OTHER.findall(data))
    damaged = sum(1 for line in data.splitlines() if line.strip()) - len(stamps) - other
    warnings = []
    if other:
        warnings.append(f"{other} remote or error frames left out")
    if damaged:
        warnings.append(f"{damaged} damaged lines left out of {len(stamps) + damaged + other}")
    return frame_table(stamps, identifiers, extended, payloads, buses, tuple(warnings))


def _without_flags(packed: bytes) -> bytes:
    """The data of the compact form; a CAN FD frame has a second `#` and a digit of flags first."""
    return packed[2:] if packed.startswith(b"#") else packed
