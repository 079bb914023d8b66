# SPDX-License-Identifier: MIT
"""Reader of the traces of PEAK-System's tools, TRC: versions 1.0 to 1.3, 2.0 and 2.1.

Own, because python-can ends at a damaged line and reads version 1.2 by the columns of 1.0.
Stamps are milliseconds from the start of the trace.
"""

from __future__ import annotations

import re

from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.formats.frames import (
    FD_LENGTHS,
    LARGEST_IDENTIFIER,
    LONGEST,
    Frames,
    collect_frames,
)

_BOM = b"\xef\xbb\xbf"
_HEAD = re.compile(rb"^\s*;\$FILEVERSION\s*=", re.IGNORECASE)
_COLUMNS = re.compile(rb"^;\$COLUMNS\s*=\s*([A-Za-z]+(?:\s*,\s*[A-Za-z]+)*)", re.MULTILINE)
_STATED = 65536
"""Bytes in which the columns are stated."""

_TIME = rb"(?P<time>[-+]?\d{1,15}(?:[.,]\d{1,6})?)"
_IDENTIFIER = rb"(?P<id>[0-9A-F]{3,8})"
_DATA = rb"(?P<data>(?:[ \t]*[0-9A-F]{2})*)"
_FLAGS = re.MULTILINE | re.IGNORECASE

_VERSION_1 = re.compile(
    rb"^[ \t]*\d+\)[ \t]+%s[ \t]+(?:(?P<bus>\d{1,2})[ \t]+)?(?:[RT]x[ \t]+)?%s[ \t]+(?:-[ \t]+)?"
    rb"(?P<code>\d{1,2})%s[ \t]*\r?$" % (_TIME, _IDENTIFIER, _DATA),
    _FLAGS,
)
_OTHER_1 = re.compile(
    rb"^[ \t]*\d+\)[ \t]+\S+[ \t]+(?:\d{1,2}[ \t]+)?(?:Warng|Error|.*[ \t]RTR\b|FFFFFFFF\b)", _FLAGS
)
"""Lines that carry no signal: error and warning frames, remote requests, states of the bus."""

_LINE = re.compile(rb"^[ \t]*[^;\s]", re.MULTILINE)

_PATTERNS = {
    b"N": rb"\d+\)?",
    b"O": _TIME,
    b"T": rb"(?:DT|FD|FB|FE|BI)",
    b"B": rb"(?P<bus>\d{1,2})",
    b"I": _IDENTIFIER,
    b"d": rb"[RT]x",
    b"L": rb"(?P<code>\d{1,2})",
    b"l": rb"(?P<length>\d{1,2})",
}
"""Pattern of each column of version 2 that is read; others hold one word."""


def is_trc(head: bytes) -> bool:
    """Return True if the first bytes of a file are a trace; version 1.0 does not state its name."""
    head = head.removeprefix(_BOM)
    named = _HEAD.match(head) is not None
    return named or (head.lstrip().startswith(b";") and _VERSION_1.search(head) is not None)


def read_trc(data: bytes, file: str) -> Frames:
    """Read all data frames; damaged lines, remote and error frames are counted in the warnings.

    Raises FileFormatError without a single frame, and where the columns do not hold frames.
    """
    data = data.removeprefix(_BOM)
    stated = _COLUMNS.search(data[:_STATED])
    line = _VERSION_1 if stated is None else _compile_line(stated[1], file)
    other = _OTHER_1 if stated is None else _compile_other(stated[1])
    rows = []
    for match in line.finditer(data):
        part = match.groupdict()
        payload = bytes.fromhex(part["data"].decode())
        code, stated_length = int(part.get("code") or 0), part.get("length")
        length = FD_LENGTHS[min(code, 15)] if stated_length is None else int(stated_length)
        identifier, extended = int(part["id"], 16), len(part["id"]) > 4
        if len(payload) == length <= LONGEST and identifier <= LARGEST_IDENTIFIER[extended]:
            time = float(part["time"].replace(b",", b".")) * 1e-3
            bus = f"channel {int(part.get('bus') or 1) - 1}"
            rows.append((time, identifier, extended, payload, bus))
    lines, left_out = len(_LINE.findall(data)), len(other.findall(data))
    return collect_frames(rows, file, lines=lines, other=left_out)


def _split_columns(stated: bytes) -> list[bytes]:
    return [name.strip() for name in stated.split(b",")]


def _compile_line(stated: bytes, file: str) -> re.Pattern[bytes]:
    """Return the pattern of a data frame of version 2 with the columns stated."""
    columns = _split_columns(stated)
    wanted = {b"O", b"T", b"I", b"D"}
    if not wanted <= set(columns) or len(set(columns)) < len(columns) or columns[-1] != b"D":
        raise FileFormatError(
            f"its columns {stated.decode()} do not hold time, type, identifier and data",
            "record the trace again with the columns N,O,T,B,I,d,R,L,D",
            Where(file=file),
        )
    parts = [_PATTERNS.get(name, rb"\S+") for name in columns[:-1]]
    return re.compile(rb"^[ \t]*%s%s[ \t]*\r?$" % (rb"[ \t]+".join(parts), _DATA), _FLAGS)


def _compile_other(stated: bytes) -> re.Pattern[bytes]:
    """Return the pattern of a line of version 2 that is no data frame: of another type."""
    before = _split_columns(stated).index(b"T")
    return re.compile(
        rb"^[ \t]*(?:[^\s;]\S*[ \t]+){%d}(?!DT|FD|FB|FE|BI)[A-Z]{2}\b" % before, _FLAGS
    )
