# SPDX-License-Identifier: MIT
"""Reader of the tables of SavvyCAN and GVRET: `Time Stamp,ID,Extended,Dir,Bus,LEN,D1,...`.

Stamps are microseconds; identifiers and data are hexadecimal. Older versions have no `Dir`.
"""

from __future__ import annotations

import re

from drivetwin.logs.formats.frames import LARGEST_IDENTIFIER, LONGEST, Frames, collect_frames

_HEAD = re.compile(
    rb"^(?:\xef\xbb\xbf)?Time Stamp,ID,Extended,(?P<way>Dir,)?Bus,LEN,D1\b[^\r\n]*", re.IGNORECASE
)
_ROW = (
    rb"^(?P<time>-?\d{1,18}),(?:0x)?(?P<id>[0-9A-F]{1,8}),(?P<long>true|false|0|1),"
    rb"%s(?P<bus>\d{1,3}),(?P<count>\d{1,2})(?P<data>(?:,[0-9A-F]{0,2})*)[ \t]*\r?$"
)
_FLAGS = re.MULTILINE | re.IGNORECASE
_ROWS = {True: re.compile(_ROW % rb"[RT]x,", _FLAGS), False: re.compile(_ROW % b"", _FLAGS)}


def is_gvret(head: bytes) -> bool:
    """Return True if the first bytes of a file are the head of such a table."""
    return _HEAD.match(head) is not None


def read_gvret(data: bytes, file: str) -> Frames:
    """Read all data frames; damaged lines are counted in the warnings.

    Raises FileFormatError without a single frame.
    """
    head = _HEAD.match(data)
    assert head is not None
    rows = []
    for match in _ROWS[head["way"] is not None].finditer(data, head.end()):
        part = match.groupdict()
        cells = [cell for cell in part["data"].split(b",") if cell]
        payload = bytes(int(cell, 16) for cell in cells[: int(part["count"])])
        identifier, extended = int(part["id"], 16), part["long"].lower() in (b"true", b"1")
        if (
            len(payload) == int(part["count"]) <= LONGEST
            and identifier <= LARGEST_IDENTIFIER[extended]
        ):
            bus = f"channel {int(part['bus'])}"
            rows.append((1e-6 * int(part["time"]), identifier, extended, payload, bus))
    lines = sum(1 for line in data[head.end() :].splitlines() if line.strip())
    return collect_frames(rows, file, lines=lines)
