# SPDX-License-Identifier: MIT
"""From the text of a table's cells to numbers, without guessing."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.channels.shiftlog import FloatArray
from drivetwin.errors import FileFormatError, Where

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_COMMA_NUMBER = re.compile(r"[+-]?(\d+,\d*|,\d+)([eE][+-]?\d+)?", re.ASCII)
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)
"""A number with comma that may be a whole one from a thousand to a million."""

_GROUPED = re.compile(r"[+-]?\d{1,3}([ .,'’\u00a0\u202f]\d{3})+([.,]\d*)?", re.ASCII)
"""A number with signs between its thousands, in the manner of any country."""

_NOT_A_NUMBER = re.compile(
    r"[+-]?(nan|nan\((ind|snan)\)|inf|infinity|1\.#(ind|qnan|snan|inf)0*)|#?n/a|na|null|none|"
    r"#nv|#n/v|#num!|#div/0!|#zahl!|#value!|#wert!",
    re.IGNORECASE,
)
"""Words for no number: of C libraries, of databases, of Excel in English and German."""


@dataclass(frozen=True, eq=False)
class Numbers:
    """A column as numbers: `values` (n,) where `present` (n,); NaN where the file contains one.

    `fault` names the first cell that is neither number, empty, nor a word for "no number".
    """

    values: FloatArray
    present: NDArray[np.bool_]
    fault: str | None = None


def is_number(cell: str, decimal: str = ".") -> bool:
    """Return True if a cell is a number with this decimal sign."""
    pattern = _NUMBER if decimal == "." else _COMMA_NUMBER
    return pattern.fullmatch(cell.strip()) is not None


def detect_decimal_sign(rows: Sequence[Sequence[str]], file: str) -> str:
    """Return `,` where numbers in `rows` are written with it, else `.`.

    Raises FileFormatError where both occur: then one of them groups thousands; and where each comma
    stands as between thousands, in the file or in a column that holds whole numbers without.
    """
    commas = [cell for row in rows for cell in row if "," in cell]
    example = next((cell.strip() for cell in commas if is_number(cell, ",")), None)
    if example is None:
        return "."
    pointed = next((c for row in rows for c in row if "." in c and is_number(c)), None)
    if pointed is not None:
        fault = f"numbers with point ({pointed.strip()!r}) and with comma ({example!r})"
    elif can_be_grouping(commas):
        fault = f"the comma in {example!r} and all others may stand for decimals or for thousands"
    elif (
        grouped := next(filter(None, map(_find_ambiguous_grouping, zip(*rows, strict=True))), None)
    ) is not None:
        fault = f"a column with {grouped[0]!r} and {grouped[1]!r}: the comma may group thousands"
    else:
        return ","
    remedy = "export with one decimal sign and no sign between thousands"
    raise FileFormatError(fault, remedy, Where(file=file))


def can_be_grouping(commas: Iterable[str]) -> bool:
    """Return True if every comma in the cells may be a thousands separator."""
    return all(_THOUSANDS.fullmatch(cell.strip()) for cell in commas if is_number(cell, ","))


def _find_ambiguous_grouping(column: Sequence[str]) -> tuple[str, str] | None:
    """Return a number with comma and one without from a column whose commas may group thousands."""
    commas = [cell for cell in column if "," in cell]
    example = next((cell.strip() for cell in commas if is_number(cell, ",")), None)
    if example is None or not can_be_grouping(commas):
        return None
    whole = next((cell.strip() for cell in column if is_number(cell)), None)
    return None if whole is None else (example, whole)


def to_numbers(cells: Sequence[str], line_numbers: Sequence[int], decimal: str) -> Numbers:
    """Convert the cells of one column; `line_numbers` place a faulty cell in the file."""
    plain = cells if decimal == "." else [cell.replace(",", ".") for cell in cells]
    try:
        values = np.fromiter(map(float, plain), np.float64, len(plain))
    except ValueError:
        return _convert_cell_by_cell(cells, plain, line_numbers)
    if any("_" in cell for cell in plain):  # float() takes 1_000 for a number
        return _convert_cell_by_cell(cells, plain, line_numbers)
    return Numbers(values, np.ones(len(plain), dtype=np.bool_))


def _convert_cell_by_cell(
    cells: Sequence[str], plain: Sequence[str], line_numbers: Sequence[int]
) -> Numbers:
    values = np.full(len(cells), np.nan)
    present = np.ones(len(cells), dtype=np.bool_)
    fault = None
    for row, text in enumerate(map(str.strip, plain)):
        if not text:
            present[row] = False
        elif _NUMBER.fullmatch(text):
            values[row] = float(text)
        elif fault is None and not _NOT_A_NUMBER.fullmatch(text):
            cell = cells[row].strip()
            fault = f"line {line_numbers[row]}: {cell[:40]!r} is no number"
            if _GROUPED.fullmatch(cell):
                fault += " that can be read: export without signs between thousands"
    return Numbers(values, present, fault)
