# SPDX-License-Identifier: MIT
"""Borders for texts of others: characters without a glyph are escaped, cells of CSV stay texts."""

from __future__ import annotations

import csv
import re
import unicodedata
from collections.abc import Iterable
from numbers import Number

_HIDDEN = frozenset({"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"})
"""Unicode categories that have no glyph: controls, bidirectional marks, surrogates, unassigned."""
_HIDDEN_JSON = re.compile(
    r"(?<!\\)((?:\\\\)*)\\u(00[01][0-9a-f]|007f|00[89][0-9a-f]|00ad|061c|180e|200[b-f]|202[89a-e]|"
    r"206[0-9a-f]|feff|fff[9ab])",
    re.IGNORECASE,
)


def escape_text(text: str, keep: str = "\n\t") -> str:
    r"""Return the text with characters that have no glyph as escapes, such as `\x1b` or `\u202e`.

    Terminals and browsers obey control characters, escape sequences and bidirectional overrides.
    The characters in `keep` stay.
    """
    if text.isprintable() or text in keep:
        return text
    return "".join(
        _escape(one) if unicodedata.category(one) in _HIDDEN and one not in keep else one
        for one in text
    )


def escape_line(text: str) -> str:
    """Return the text on one line, with characters that have no glyph as escapes."""
    return escape_text(text, keep="")


def escape_json(text: str) -> str:
    r"""Return a JSON document in which characters without a glyph are `\u` escapes.

    The document has the same values.
    """
    return re.sub(r"[^\x20-\x7e\n\t]", lambda found: _escape_in_json(found[0]), text)


def show_json_escapes(text: str) -> str:
    r"""Return a JSON document whose texts show the escapes of characters without a glyph.

    A browser that reads `"\u202e"` obeys it; from `"\\u202e"` it displays the escape.
    """
    return _HIDDEN_JSON.sub(r"\1\\\\u\2", escape_json(text))


def _escape(char: str) -> str:
    code = ord(char)
    return (
        f"\\x{code:02x}"
        if code < 0x100
        else f"\\u{code:04x}"
        if code < 0x10000
        else (f"\\U{code:08x}")
    )


def _escape_in_json(char: str) -> str:
    if unicodedata.category(char) not in _HIDDEN:
        return char
    units = char.encode("utf-16-be", "surrogatepass").hex()
    return "".join(f"\\u{units[k : k + 4]}" for k in range(0, len(units), 4))


_COMPUTED = re.compile(r"'*[=+\-@\t\r]")
_PROTECTED = re.compile(r"'+[=+\-@\t\r]")
_QUOTED = re.compile(r"""[,;"\r\n\t]|^['\s]|\s$""")


class NumberText(str):
    """A number that was formatted already; written as it is."""

    __slots__ = ()


def format_csv_row(cells: Iterable[object]) -> str:
    """Return one row with its line end; numbers as they are, None as an empty cell."""
    return ",".join(map(_format_cell, cells)) + "\n"


def restore_cell(text: str) -> str:
    """Return a text cell as it was before `format_csv_row` protected it."""
    return text[1:] if _PROTECTED.match(text) else text


def parse_csv_row(line: str) -> list[str]:
    """Return the text cells of one line."""
    return [restore_cell(cell) for cell in next(csv.reader([line]), [])]


def _format_cell(cell: object) -> str:
    if cell is None:
        return ""
    if isinstance(cell, Number | NumberText):
        return str(cell)
    text = str(cell)
    protected = f"'{text}" if _COMPUTED.match(text) else text
    if protected == text and not _QUOTED.search(text):
        return text
    return '"' + protected.replace('"', '""') + '"'
