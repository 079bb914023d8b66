# SPDX-License-Identifier: MIT
"""Texts that are numbers: a conversion that gives `2` for the code 3 states the value 2."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.channels.shiftlog import FloatArray
from drivetwin.logs.formats.cell_text import is_number


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
