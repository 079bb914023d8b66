# SPDX-License-Identifier: MIT
"""Bus logs in text format, recognised by their first bytes; logs of tools without a reader.

Native logs of bus tools for which there is no reader are refused by name, with a way to convert.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.formats.can.database import PAYLOAD, Frames
from drivetwin.logs.formats.can.line_format import LineFormat, read_lines
from drivetwin.logs.raw import HEAD_BYTES

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


def _compile_line_formats(pattern: bytes, **parts: bytes) -> re.Pattern[bytes]:
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
    frame=_compile_line_formats(
        _CANDUMP_START + rb"(?:(?P<standard>[0-9A-F]{3})|(?P<extended>[01][0-9A-F]{7}))"
        rb"(?:~\[(?P<count>\d{1,2})\](?P<data>(?:~[0-9A-F]{2})*)"
        rb"|#(?:#[0-9A-F])?(?P<data2>(?:[0-9A-F]{2}\.?)*))(?:~(?:'[^\n]*|[RT]))?[ \t]*\r?$"
    ),
    # Bit 29 marks an error frame.
    other=_compile_line_formats(
        _CANDUMP_START + rb"(?:[23][0-9A-F]{7}(?:~\[|#)"
        rb"|[0-9A-F]{3,8}(?:#R\d?\b|~\[\d+\](?:~remote~request\b|[^\n]*~ERRORFRAME\b)))"
    ),
    # The meaning of an error frame follows in a line that begins with a tab.
    meant=re.compile(rb"^ *\S", re.MULTILINE),
    bare=_compile_line_formats(rb"^[ \t]*[\w.:-]+~[0-9A-F]{3,8}~\[\d{1,2}\](?:~[0-9A-F]{2})*$"),
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
_ASC_HEAD = _compile_line_formats(
    rb"(?i)^(?:date~[A-Z][a-z]{2}~|base~(?:hex|dec)\b|Begin Triggerblock"
    rb"|[ \t]*<stamp>~(?:CANFD~\d+~<way>\b|\d+~\S+~<way>~[dr]\b))",
    stamp=_STAMP,
    way=_WAY,
)
_ASC_RELATIVE = _compile_line_formats(rb"(?i)^base~\w+~timestamps~relative")
_ASC_DECIMAL = _compile_line_formats(rb"(?i)^base~dec\b")


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
        frame=_compile_line_formats(
            rb"^[ \t]*(?P<time><stamp>)~(?:(?P<bus>\d{1,3})~"
            rb"(?:(?P<standard><id>)|(?P<extended><id>)[xX]|[^ \t\r\n]+)~<way>~[dD]~"
            rb"(?P<code><digit>{1,2})(?P<data><bytes>)(?:[^\r\n]*[ \t](?i:ID)[ \t]*=[ \t]*"
            rb"(?:(?P<wide>\d{1,10})[xX]|(?P<number>\d{1,10})))?"
            rb"|(?i:CANFD)~(?P<bus2>\d{1,3})~<way>~"
            rb"(?:(?P<standard2><id>)|(?P<extended2><id>)[xX])~(?:[A-Za-z_]\S*~)?"
            rb"[01]~[01]~[0-9A-F]{1,2}~(?P<count>\d{1,2})(?P<data2><bytes>))",
            **parts,
        ),
        other=_compile_line_formats(
            rb"(?i)^[ \t]*<stamp>~"
            rb"(?:\d+~(?:\S+~<way>~r\b|ErrorFrame\b)|CANFD~\d+~<way>~ErrorFrame\b)",
            **parts,
        ),
        meant=_compile_line_formats(
            rb"(?i)^[ \t]*\S+~(?:\d+~\S+~<way>\b|CANFD~\d+~<way>\b|\d+~ErrorFrame\b)", **parts
        ),
        event=_compile_line_formats(rb"^[ \t]*(<stamp>)[ \t]", **parts)
        if _ASC_RELATIVE.search(head)
        else None,
        base=base,
        code_base=base,
        lengths=range(PAYLOAD + 1),
        has_cells=base == 10,
        is_open=True,
    )


_TRC_HEAD = _compile_line_formats(rb"(?i)^\s*;\$FILEVERSION\s*=")
_TRC_COLUMNS = _compile_line_formats(rb"^;\$COLUMNS\s*=\s*([A-Za-z]+(?:\s*,\s*[A-Za-z]+)*)")
_TRC_PARTS = {
    "time": rb"(?P<time>[-+]?\d{1,15}(?:[.,]\d{1,6})?)",
    "id": rb"(?:(?P<standard>[0-9A-F]{3,4})|(?P<extended>[0-9A-F]{5,8}))",
    "data": rb"(?P<data>(?:[ \t]*[0-9A-F]{2})*)[ \t]*\r?$",
}
_TRC_LINE = re.compile(rb"^[ \t]*[^;\s]", re.MULTILINE)
_TRC = LineFormat(
    frame=_compile_line_formats(
        rb"^[ \t]*\d+\)~<time>~(?:(?P<bus>\d{1,2})~)?(?:(?i:[RT]x)~)?<id>~(?:-~)?"
        rb"(?P<code>\d{1,2})<data>",
        **_TRC_PARTS,
    ),
    other=_compile_line_formats(
        rb"(?i)^[ \t]*\d+\)~\S+~(?:\d{1,2}~)?(?:Warng|Error|.*[ \t]RTR\b|FFFFFFFF\b)"
    ),
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
        frame=_compile_line_formats(rb"^[ \t]*%s<data>" % cells, **_TRC_PARTS),
        other=_compile_line_formats(
            rb"^[ \t]*(?:[^\s;]\S*~){%d}(?!DT|FD|FB|FE|BI)[A-Z]{2}\b" % before, **_TRC_PARTS
        ),
        meant=_TRC_LINE,
        tick=1e-3,
    )


_GVRET_HEAD = _compile_line_formats(
    rb"(?i)^Time Stamp,ID,Extended,(?P<way>Dir,)?Bus,LEN,D1\b[^\r\n]*"
)


def _choose_gvret(data: bytes, _file: str) -> LineFormat:
    """Return the lines of a table of SavvyCAN, with or without `Dir`."""
    head = _GVRET_HEAD.match(data)
    way = rb"(?i:[RT]x)," if head is not None and head["way"] else b""
    identifier = rb"(?:(?P<standard><id>),(?i:false|0)|(?P<extended><id>),(?i:true|1))"
    return LineFormat(
        frame=_compile_line_formats(
            rb"^(?P<time>-?\d{1,18}),(?:0x)?%s,%s(?P<bus>\d{1,3}),(?P<count>\d{1,2})"
            rb"(?P<data>(?:,[0-9A-F]{0,2})*)[ \t]*\r?$" % (identifier, way),
            id=rb"[0-9A-F]{1,8}",
        ),
        other=_compile_line_formats(rb"(?!)"),
        meant=re.compile(rb"^(?!Time Stamp,)[ \t]*\S", re.MULTILINE | re.IGNORECASE),
        tick=1e-6,
        has_cells=True,
        is_open=True,
        first_bus=0,
    )


def is_bus_text(head: bytes) -> bool:
    """Return True if the first bytes of a file are a bus log in text format."""
    return find_line_format(head.removeprefix(BOM)) is not None


def read_bus_text(data: bytes, file: str) -> Frames:
    """Read the frames of a bus log in text format. Raises FileFormatError."""
    data = data.removeprefix(BOM)
    choose = find_line_format(data[:HEAD_BYTES])
    assert choose is not None
    return read_lines(choose(data, file), data, file)


_TO_ASC = "export it as ASC, BLF, MDF 4, a PEAK trace or 'candump -L' text"
_BY_PYTHON_CAN = "convert it: 'python -m can.logconvert LOG log.blf' of python-can"
_BY_SAVVYCAN = "open it in SavvyCAN and save it as GVRET log, Vector ASC or PEAK trace"


@dataclass(frozen=True)
class _Tool:
    """Name of a log, the pattern at its start, and how to convert it."""

    name: str
    pattern: re.Pattern[bytes]
    remedy: str


def _compile(pattern: bytes) -> re.Pattern[bytes]:
    return re.compile(pattern, re.IGNORECASE | re.MULTILINE)


_TOOLS = (
    _Tool(
        "a BUSMASTER log",
        _compile(rb"\A\s*-?\*\*\*(?:BUSMASTER Ver|PROTOCOL )"),
        f"convert it with the log to ASC converter of BUSMASTER, or {_BY_SAVVYCAN}",
    ),
    _Tool(
        "a text log of Kvaser CanKing",
        _compile(rb"^[ \t]*Chn[ \t]+Identifier[ \t]+Flg[ \t]+DLC\b"),
        _BY_SAVVYCAN,
    ),
    _Tool(
        "a table of Vehicle Spy",
        _compile(rb"^\"?Line\"?,\"?Abs Time\(Sec\)\"?,\"?Rel Time"),
        "export it from Vehicle Spy as ASC, BLF or MDF 4",
    ),
    _Tool(
        "a binary log of Vehicle Spy",
        re.compile(rb"\Aicsbin"),
        "export it from Vehicle Spy as ASC, BLF or MDF 4",
    ),
    _Tool(
        "a CSV log of python-can",
        _compile(rb"\A(?:\xef\xbb\xbf)?timestamp,arbitration_id,extended,remote,error,dlc,data"),
        _BY_PYTHON_CAN,
    ),
    _Tool(
        "an SQLite file, as python-can writes", re.compile(rb"\ASQLite format 3\0"), _BY_PYTHON_CAN
    ),
    _Tool(
        "a capture of Wireshark (pcap)",
        re.compile(
            rb"\A(?:\xd4\xc3\xb2\xa1|\xa1\xb2\xc3\xd4|\x4d\x3c\xb2\xa1|\xa1\xb2\x3c\x4d"
            rb"|\x0a\x0d\x0d\x0a)",
            re.DOTALL,
        ),
        "record the bus with 'candump -L', or as ASC, BLF or MDF 4",
    ),
    _Tool(
        "a CRTD log of OVMS",
        _compile(rb"\A\s*\d+\.\d+ \d?(?:C[A-Z]{2}|[RT](?:11|29)) "),
        _BY_SAVVYCAN,
    ),
    _Tool(
        "a text log of a CSS logger (CLX000)",
        _compile(rb"\A(?:#[^\n]*\n)*# Logger type: C[LA]"),
        "convert it to MDF 4 or ASC with the converter of the logger",
    ),
    _Tool(
        "a log of the Microchip CAN bus analyzer",
        _compile(rb"\A(?:[^\n]*\n){0,3}[^\n]*(?:Microchip Technology|CAN BUS Analyzer)"),
        _BY_SAVVYCAN,
    ),
    _Tool("a trace of IXXAT", _compile(rb"\A[^\n]*ASCII Trace IXXAT"), _BY_SAVVYCAN),
    _Tool(
        "raw frames in the format of slcan",
        re.compile(
            rb"\A(?:t[0-9A-Fa-f]{3}[0-8][0-9A-Fa-f]*\r?\n?|T[0-9A-Fa-f]{8}[0-8][0-9A-Fa-f]*"
            rb"\r?\n?){3}"
        ),
        "record the bus with 'candump -L', which has time stamps",
    ),
)

_IDENTIFIERS = frozenset(
    ("id", "canid", "arbid", "arbitrationid", "identifier", "messageid", "msgid", "idhex", "addr")
)
_LENGTHS = frozenset(("dlc", "len", "length", "datalength", "bytes"))
_DATA = frozenset(("data", "databytes", "datahex", "payload", "message", "messagedata"))
_BYTE = re.compile(r"(?:d|b|db|byte|data|databyte)\d{1,2}")
_LEAST_BYTES = 4
"""Columns of single bytes that show a table of frames [count]."""

_LOOKED_AT = 60
"""Lines in which the head of a table is looked for [count]."""


def refuse_bus_tool(head: bytes, path: Path) -> None:
    """Raise FileFormatError if the first bytes are a native log of a bus tool without a reader."""
    for tool in _TOOLS:
        if tool.pattern.search(head):
            raise FileFormatError(
                f"this is {tool.name}, for which there is no reader",
                tool.remedy,
                Where(file=str(path)),
            )
    if _is_frame_table(head):
        raise FileFormatError(
            "this is a table of raw bus frames, not of signals: it has columns for identifier "
            "and data bytes",
            f"{_TO_ASC}, and state the DBC file of the bus; or export decoded signals",
            Where(file=str(path)),
        )


def _is_frame_table(head: bytes) -> bool:
    """Return True if one of the first lines names an identifier, and data or many bytes."""
    for line in head.splitlines()[:_LOOKED_AT]:
        cells = re.split(r"[,;\t|]", line.decode("latin-1"))
        names = [re.sub(r"[\W_]", "", re.sub(r"[\[(].*", "", cell).casefold()) for cell in cells]
        if not _IDENTIFIERS.intersection(names):
            continue
        count = len({name for name in names if _BYTE.fullmatch(name)})
        stated = bool(_DATA.intersection(names)) and bool(
            _LENGTHS.intersection(names) or {"bus", "channel", "type", "extended"} & set(names)
        )
        if count >= _LEAST_BYTES or stated:
            return True
    return False
