# SPDX-License-Identifier: MIT
"""Bus logs in text format, recognised by their first bytes; logs of tools without a reader.

Native logs of bus tools for which there is no reader are refused by name, with a way to convert.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.formats.can.line_format import read_lines
from drivetwin.logs.formats.can.line_formats import BOM, find_line_format
from drivetwin.logs.formats.frames import Frames
from drivetwin.logs.raw import HEAD_BYTES


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
