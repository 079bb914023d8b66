# SPDX-License-Identifier: MIT
"""Reader of candump text: the human-readable pattern, and the compact one of `candump -L`."""

from __future__ import annotations

import re
from datetime import UTC, datetime

import numpy as np

from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.formats.frames import LONGEST, FrameRow, Frames, collect_frames

_STAMP = rb"^[ \t]*\((?P<time>(?:\d{4}-\d{2}-\d{2} \d{2}:\d{2}:)?-?\d{1,12}\.\d{1,9})\)[ \t]+"
_LINE = re.compile(
    _STAMP + rb"(?P<bus>[\w.:-]+)[ \t]+"
    rb"(?:(?:RX|TX|[-BE]{2})[ \t]+(?:[-BE]{2}[ \t]+)?)?(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})"
    rb"(?:[ \t]+\[(?P<count>\d{1,2})\](?P<spaced>(?:[ \t]+[0-9A-Fa-f]{2})*)"
    rb"|#(?P<packed>(?:#[0-9A-Fa-f])?(?:[0-9A-Fa-f]{2}\.?)*))"
    rb"(?:[ \t]+(?:'[^\n]*|[RT]))?[ \t]*\r?$",
    re.MULTILINE,
)
_OTHER = re.compile(_STAMP + rb"[\w.:-]+[ \t]+[0-9A-Fa-f]{3,8}"
                    rb"(?:[ \t]+\[\d+\][ \t]+(?:remote request|ERRORFRAME)|#R\d?\b)",
                    re.MULTILINE)  # fmt: skip
"""Remote requests and error frames: lines of a sound file that carry no signal."""

_BARE = re.compile(
    rb"^[ \t]*[\w.:-]+[ \t]+[0-9A-Fa-f]{3,8}[ \t]+\[\d{1,2}\](?:[ \t]+[0-9A-Fa-f]{2})*$"
)
"""A line without a time stamp."""

_RECORD = "record the bus with 'candump -L'"
_BACKWARD, _ENOUGH = 0.1, 100
"""Share of steps back in time, of so many frames at least, from which stamps are of no clock."""


def is_candump(head: bytes) -> bool:
    """Return True if the first bytes of a file are candump text."""
    lines = [line for line in head.splitlines()[:60] if line.strip()]
    patterns = (_LINE, _OTHER, _BARE)
    fitting = sum(any(pattern.match(line) for pattern in patterns) for line in lines)
    return fitting > 0 and fitting >= len(lines) // 2


def read_candump(data: bytes, file: str) -> Frames:
    """Read all data frames; lines that are none are counted in the warnings.

    Raises FileFormatError without a single frame, and for stamps that count from frame to frame.
    """
    rows: list[FrameRow] = []
    for match in _LINE.finditer(data):
        stamp, bus, identifier, count, spaced, packed = match.groups()
        digits = _drop_flags(packed) if spaced is None else spaced
        payload = bytes.fromhex(digits.replace(b".", b"").decode())
        time = _parse_seconds(stamp)
        wrong = count is not None and int(count) != len(payload)
        if time is None or len(payload) > LONGEST or wrong:
            continue
        rows.append((time, int(identifier, 16), len(identifier) == 8, payload, bus.decode()))
    if not rows:
        bare = any(_BARE.match(line) for line in data[:8192].splitlines())
        what = "its lines have no time stamps" if bare else "no frame can be read"
        raise FileFormatError(what, _RECORD, Where(file=file))
    backward = np.count_nonzero(np.diff([row[0] for row in rows]) < 0.0)
    if len(rows) >= _ENOUGH and backward > _BACKWARD * len(rows):
        what = "its time stamps run back again and again: they count from frame to frame"
        raise FileFormatError(what, _RECORD, Where(file=file))
    other = len(_OTHER.findall(data))
    lines = sum(1 for line in data.splitlines() if line.strip())
    return collect_frames(rows, file, lines=lines, other=other)


def _parse_seconds(stamp: bytes) -> float | None:
    """A stamp [s], counted from 1970 where it is a date; None for a date that does not exist."""
    if b":" not in stamp:
        return float(stamp)
    day, _, seconds = stamp.rpartition(b":")
    try:
        minute = datetime.fromisoformat(day.decode()).replace(tzinfo=UTC)
    except ValueError:
        return None
    return minute.timestamp() + float(seconds)


def _drop_flags(packed: bytes) -> bytes:
    """The data of a compact line; a CAN FD frame has a second `#` and a digit of flags first."""
    return packed[2:] if packed.startswith(b"#") else packed
