# SPDX-License-Identifier: MIT
"""Meaning of the text of a table's cells, without guessing."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from drivetwin.channels.shiftlog import FloatArray
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


@dataclass(frozen=True, eq=False)
class NumberTexts:
    """Numbers (n,) of texts, NaN where a text is no number; `note` describes the choice."""

    values: FloatArray
    note: str


def parse_numbers(texts: Iterable[str]) -> FloatArray:
    """Return the numbers (n,) of texts; NaN for texts that are no numbers.

    A comma may be a decimal sign or stand between thousands: such a text is no number.
    """
    stripped = [text.strip() for text in texts]
    known = [is_number(text) and "," not in text for text in stripped]
    return np.array([float(x) if ok else np.nan for x, ok in zip(stripped, known, strict=True)])


def select_numbers(texts: Sequence[str], codes: FloatArray) -> NumberTexts | None:
    """Return the numbers that stand for `codes` (n,) by their texts (n,).

    Returns None where the codes are to be taken: no text is a number, or those that are state the
    code itself and others name codes, such as `N` beside `1` and `2`.
    """
    values = parse_numbers(texts)
    is_value = np.isfinite(values)
    same = np.array_equal(values[is_value], codes[is_value])
    if not is_value.any() or (same and not is_value.all()):
        return None
    others = [text.strip() for text, number in zip(texts, is_value, strict=True) if not number]
    named = ", ".join(repr(text) for text in dict.fromkeys(others) if text)
    note = "texts that are numbers taken as values" + (f", not {named}" if named else "")
    return NumberTexts(values, "" if same else note)
