# SPDX-License-Identifier: MIT
"""Border for CSV: rows whose text cells a spreadsheet shows as texts and never computes.

A cell that starts with `=`, `+`, `-`, `@`, a tab or a carriage return would be computed or split.
Texts that start so get an apostrophe in front; reading takes it away again. Numbers stay as they
are.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable
from numbers import Number

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
