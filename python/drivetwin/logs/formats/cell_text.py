# SPDX-License-Identifier: MIT
"""Meaning of the text of a table's cells, without guessing."""

from __future__ import annotations

import re
from collections.abc import Sequence
from enum import Enum

from drivetwin.errors import FileFormatError, Where

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_COMMA_NUMBER = re.compile(r"[+-]?(\d+,\d*|,\d+)([eE][+-]?\d+)?", re.ASCII)

_GROUPED = re.compile(r"[+-]?\d{1,3}([ .,'’\u00a0\u202f]\d{3})+([.,]\d*)?", re.ASCII)
"""A number with signs between its thousands, in the manner of any country."""

_NOT_A_NUMBER = re.compile(
    r"[+-]?(nan|nan\((ind|snan)\)|inf|infinity|1\.#(ind|qnan|snan|inf)0*)|#?n/a|n\.a\.|na|<na>|nat|"
    r"\(?null\)?|none|nil|missing|invalid|#nv|#n/v|#num!|#div/0!|#zahl!|#value!|#wert!",
    re.IGNORECASE,
)
"""Words for no number: of C libraries, of databases, of Excel in English and German."""

_ABSENT = re.compile(r"[-\u2010-\u2015\u2212]{1,4}|\.{1,3}|\*{1,4}|\?{1,3}")
"""Signs that stand for an empty cell."""


class Meaning(Enum):
    """Meaning of a cell that holds no number."""

    ABSENT = "no sample"
    NO_NUMBER = "a sample without a number"
    TEXT = "a text"


def classify_text(cell: str) -> Meaning:
    """Return the meaning of a cell that holds no number."""
    if not cell or _ABSENT.fullmatch(cell):
        return Meaning.ABSENT
    return Meaning.NO_NUMBER if _NOT_A_NUMBER.fullmatch(cell) else Meaning.TEXT


def is_number(cell: str) -> bool:
    """Return True if a cell is a number with decimal point or comma."""
    text = cell.strip()
    return (_NUMBER.fullmatch(text) or _COMMA_NUMBER.fullmatch(text)) is not None


def describe_text(cell: str, line: int) -> str:
    """Describe a cell that should hold a number."""
    fault = f"line {line}: {cell[:40]!r} is no number"
    if _GROUPED.fullmatch(cell):
        fault += " that can be read: export without signs between thousands"
    return fault


Written = tuple[bytes | None, bytes | None, bytes | None, bool]
"""The first number of a column with point, with comma and without either; and whether a comma
cannot stand between thousands."""


def check_decimal_signs(columns: Sequence[Written], file: str) -> None:
    """Refuse numbers whose decimal sign is open.

    Raises FileFormatError where both point and comma occur: then one of them groups thousands; and
    where each comma stands as between thousands, in the file or in a column that holds whole
    numbers without.
    """
    comma = next((comma for _, comma, _, _ in columns if comma is not None), None)
    if comma is None:
        return
    example = comma.decode()
    point = next((point for point, _, _, _ in columns if point is not None), None)
    grouped = next(
        ((comma, whole) for _, comma, whole, clear in columns if comma and whole and not clear),
        None,
    )
    if point is not None:
        fault = f"numbers with point ({point.decode()!r}) and with comma ({example!r})"
    elif not any(clear for _, _, _, clear in columns):
        fault = f"the comma in {example!r} and all others may separate decimals or thousands"
    elif grouped is not None:
        one, other = (text.decode() for text in grouped)
        fault = f"a column with {one!r} and {other!r}: the comma may group thousands"
    else:
        return
    remedy = "export with one decimal sign and no sign between thousands"
    raise FileFormatError(fault, remedy, Where(file=file))
