# SPDX-License-Identifier: MIT
"""Line patterns of all bus logs in text format, and their recognition by the first bytes.

candump has a form for people and the compact one of `candump -L`. ASC is Vector's: classical frames
and CAN FD, hexadecimal or decimal; keywords and digits have either case. TRC is PEAK-System's:
versions 1.0 to 1.3, 2.0 and 2.1, stamps in milliseconds. The tables of SavvyCAN and GVRET count
microseconds; older versions have no `Dir`.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.formats.can.line_format import LineFormat
from drivetwin.logs.formats.frames import PAYLOAD

BOM = b"\xef\xbb\xbf"
"""Byte order mark, which is not part of the first line."""
_STATED = 65536
"""Bytes in which the base of numbers, the kind of stamps and the columns are stated."""


def find_line_format(head: bytes) -> Callable[[bytes, str], LineFormat] | None:
    """Recognise a bus log by its first bytes, without `BOM`; None for other files.

    The function returned states the format by more of the file, which errors name.
    """
    if _TRC_HEAD.match(head) or (head.lstrip().startswith(b";") and _TRC.frame.search(head)):
        return _choose_trc
    if _GVRET_HEAD.match(head):
        return _choose_gvret
    if _is_candump(head):
        return lambda *_: _CANDUMP
    return _choose_asc if _ASC_HEAD.search(head) else None


def _compile(pattern: bytes, **parts: bytes) -> re.Pattern[bytes]:
    """Compile the pattern of a line; `<name>` stands for a part, `~` for blanks.

    Digits have either case. Ignoring the case of the whole pattern takes 1.5 times as long.
    """
    for name, part in parts.items():
        pattern = pattern.replace(b"<%s>" % name.encode(), part)
    pattern = pattern.replace(b"~", rb"[ \t]+").replace(b"A-F", b"A-Fa-f")
    return re.compile(pattern, re.MULTILINE)


_CANDUMP_START = (
    rb"^[ \t]*\((?P<time>(?:\d{4}-\d{2}-\d{2}~\d{2}:\d{2}:)?-?\d{1,12}\.\d{1,9})\)~"
    rb"(?P<bus>[\w.:-]+)~(?:[RT]X~)?(?:[-BE][ \t]?[-BE]~)?"
)
_CANDUMP = LineFormat(
    frame=_compile(
        _CANDUMP_START + rb"(?:(?P<standard>[0-9A-F]{3})|(?P<extended>[01][0-9A-F]{7}))"
        rb"(?:~\[(?P<count>\d{1,2})\](?P<data>(?:~[0-9A-F]{2})*)"
        rb"|#(?:#[0-9A-F])?(?P<data2>(?:[0-9A-F]{2}\.?)*))(?:~(?:'[^\n]*|[RT]))?[ \t]*\r?$"
    ),
    # Bit 29 marks an error frame.
    other=_compile(
        _CANDUMP_START + rb"(?:[23][0-9A-F]{7}(?:~\[|#)"
        rb"|[0-9A-F]{3,8}(?:#R\d?\b|~\[\d+\](?:~remote~request\b|[^\n]*~ERRORFRAME\b)))"
    ),
    # The meaning of an error frame follows in a line that begins with a tab.
    meant=re.compile(rb"^ *\S", re.MULTILINE),
    bare=_compile(rb"^[ \t]*[\w.:-]+~[0-9A-F]{3,8}~\[\d{1,2}\](?:~[0-9A-F]{2})*$"),
    first_bus=None,
    remedy="record the bus with 'candump -L'",
)
_SHOWN = 60
"""First lines of which half have to be those of candump [count]."""


def _is_candump(head: bytes) -> bool:
    lines = [line for line in head.splitlines()[:_SHOWN] if line.strip()]
    patterns = [one for one in (_CANDUMP.frame, _CANDUMP.other, _CANDUMP.bare) if one is not None]
    fitting = sum(any(pattern.match(line) for pattern in patterns) for line in lines)
    return fitting > 0 and fitting >= len(lines) // 2


_STAMP, _WAY = rb"[-+]?\d{1,12}[.,]\d{1,9}", rb"(?i:Rx|Tx|TxRq)"
_ASC_HEAD = _compile(
    rb"(?i)^(?:date~[A-Z][a-z]{2}~|base~(?:hex|dec)\b|Begin Triggerblock"
    rb"|[ \t]*<stamp>~(?:CANFD~\d+~<way>\b|\d+~\S+~<way>~[dr]\b))",
    stamp=_STAMP,
    way=_WAY,
)
_ASC_RELATIVE = _compile(rb"(?i)^base~\w+~timestamps~relative")
_ASC_DECIMAL = _compile(rb"(?i)^base~dec\b")


def _choose_asc(data: bytes, _file: str) -> LineFormat:
    """Return the lines of ASC; the decimal number at the end is that of a symbolic name."""
    head = data[:_STATED]
    base = 10 if _ASC_DECIMAL.search(head) else 16
    digit, cell = (rb"[0-9A-F]", rb"[0-9A-F]{2}") if base == 16 else (rb"\d", rb"\d{1,3}")
    parts = {
        "stamp": _STAMP,
        "way": _WAY,
        "id": digit + rb"{1,10}",
        "digit": digit,
        "bytes": rb"(?:~%s(?![^ \t\r\n]))*" % cell,
    }
    return LineFormat(
        frame=_compile(
            rb"^[ \t]*(?P<time><stamp>)~(?:(?P<bus>\d{1,3})~"
            rb"(?:(?P<standard><id>)|(?P<extended><id>)[xX]|[^ \t\r\n]+)~<way>~[dD]~"
            rb"(?P<code><digit>{1,2})(?P<data><bytes>)(?:[^\r\n]*[ \t](?i:ID)[ \t]*=[ \t]*"
            rb"(?:(?P<wide>\d{1,10})[xX]|(?P<number>\d{1,10})))?"
            rb"|(?i:CANFD)~(?P<bus2>\d{1,3})~<way>~"
            rb"(?:(?P<standard2><id>)|(?P<extended2><id>)[xX])~(?:[A-Za-z_]\S*~)?"
            rb"[01]~[01]~[0-9A-F]{1,2}~(?P<count>\d{1,2})(?P<data2><bytes>))",
            **parts,
        ),
        other=_compile(
            rb"(?i)^[ \t]*<stamp>~"
            rb"(?:\d+~(?:\S+~<way>~r\b|ErrorFrame\b)|CANFD~\d+~<way>~ErrorFrame\b)",
            **parts,
        ),
        meant=_compile(
            rb"(?i)^[ \t]*\S+~(?:\d+~\S+~<way>\b|CANFD~\d+~<way>\b|\d+~ErrorFrame\b)", **parts
        ),
        event=_compile(rb"^[ \t]*(<stamp>)[ \t]", **parts) if _ASC_RELATIVE.search(head) else None,
        base=base,
        code_base=base,
        lengths=range(PAYLOAD + 1),
        has_cells=base == 10,
        is_open=True,
    )


_TRC_HEAD = _compile(rb"(?i)^\s*;\$FILEVERSION\s*=")
_TRC_COLUMNS = _compile(rb"^;\$COLUMNS\s*=\s*([A-Za-z]+(?:\s*,\s*[A-Za-z]+)*)")
_TRC_PARTS = {
    "time": rb"(?P<time>[-+]?\d{1,15}(?:[.,]\d{1,6})?)",
    "id": rb"(?:(?P<standard>[0-9A-F]{3,4})|(?P<extended>[0-9A-F]{5,8}))",
    "data": rb"(?P<data>(?:[ \t]*[0-9A-F]{2})*)[ \t]*\r?$",
}
_TRC_LINE = re.compile(rb"^[ \t]*[^;\s]", re.MULTILINE)
_TRC = LineFormat(
    frame=_compile(
        rb"^[ \t]*\d+\)~<time>~(?:(?P<bus>\d{1,2})~)?(?:(?i:[RT]x)~)?<id>~(?:-~)?"
        rb"(?P<code>\d{1,2})<data>",
        **_TRC_PARTS,
    ),
    other=_compile(rb"(?i)^[ \t]*\d+\)~\S+~(?:\d{1,2}~)?(?:Warng|Error|.*[ \t]RTR\b|FFFFFFFF\b)"),
    meant=_TRC_LINE,
    tick=1e-3,
)
"""Version 1, with any of its columns."""

_TRC_COLUMN = {
    b"N": rb"\d+\)?",
    b"O": b"<time>",
    b"T": rb"(?:DT|FD|FB|FE|BI)",
    b"B": rb"(?P<bus>\d{1,2})",
    b"I": b"<id>",
    b"d": rb"(?i:[RT]x)",
    b"L": rb"(?P<code>\d{1,2})",
    b"l": rb"(?P<count>\d{1,2})",
}
"""Pattern of each column of version 2 that is read; others hold one word."""


def _choose_trc(data: bytes, file: str) -> LineFormat:
    """Return the lines of version 1, or those of version 2 with the columns stated."""
    stated = _TRC_COLUMNS.search(data[:_STATED])
    if stated is None:
        return _TRC
    columns = [name.strip() for name in stated[1].split(b",")]
    wanted = {b"O", b"T", b"I", b"D"}
    if not wanted <= set(columns) or len(set(columns)) < len(columns) or columns[-1] != b"D":
        raise FileFormatError(
            f"its columns {stated[1].decode()} do not hold time, type, identifier and data",
            "record the trace again with the columns N,O,T,B,I,d,R,L,D",
            Where(file=file),
        )
    cells = b"~".join(_TRC_COLUMN.get(name, rb"\S+") for name in columns[:-1])
    before = columns.index(b"T")
    return LineFormat(
        frame=_compile(rb"^[ \t]*%s<data>" % cells, **_TRC_PARTS),
        other=_compile(
            rb"^[ \t]*(?:[^\s;]\S*~){%d}(?!DT|FD|FB|FE|BI)[A-Z]{2}\b" % before, **_TRC_PARTS
        ),
        meant=_TRC_LINE,
        tick=1e-3,
    )


_GVRET_HEAD = _compile(rb"(?i)^Time Stamp,ID,Extended,(?P<way>Dir,)?Bus,LEN,D1\b[^\r\n]*")


def _choose_gvret(data: bytes, _file: str) -> LineFormat:
    """Return the lines of a table of SavvyCAN, with or without `Dir`."""
    head = _GVRET_HEAD.match(data)
    way = rb"(?i:[RT]x)," if head is not None and head["way"] else b""
    identifier = rb"(?:(?P<standard><id>),(?i:false|0)|(?P<extended><id>),(?i:true|1))"
    return LineFormat(
        frame=_compile(
            rb"^(?P<time>-?\d{1,18}),(?:0x)?%s,%s(?P<bus>\d{1,3}),(?P<count>\d{1,2})"
            rb"(?P<data>(?:,[0-9A-F]{0,2})*)[ \t]*\r?$" % (identifier, way),
            id=rb"[0-9A-F]{1,8}",
        ),
        other=_compile(rb"(?!)"),
        meant=re.compile(rb"^(?!Time Stamp,)[ \t]*\S", re.MULTILINE | re.IGNORECASE),
        tick=1e-6,
        has_cells=True,
        is_open=True,
        first_bus=0,
    )
