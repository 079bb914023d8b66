# SPDX-License-Identifier: MIT
"""Tokens of the Modelica language: identifiers, numbers, strings, matrices."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from drivetwin.export.parameters.content import number
from drivetwin.export.parameters.spelling import ascii_line, distinct

_KEYWORDS = re.compile(
    "algorithm|and|annotation|assert|block|break|class|connect|connector|constant|constrainedby|"
    "der|discrete|each|else|elseif|elsewhen|encapsulated|end|enumeration|equation|expandable|"
    "extends|external|false|final|flow|for|function|if|import|impure|in|initial|inner|input|loop|"
    "model|not|operator|or|outer|output|package|parameter|partial|protected|public|pure|record|"
    "redeclare|replaceable|return|stream|then|time|true|type|when|while|within"
)


def identifier(name: str) -> str:
    """The name in letters, digits and `_`, no digit in front, and no keyword."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", ascii_line(name))
    return f"x_{plain}" if not re.match("[A-Za-z]", plain) or _KEYWORDS.fullmatch(plain) else plain


def identifiers(names: Iterable[str]) -> dict[str, str]:
    """An identifier for each name; those that would coincide are numbered."""
    return distinct(names, identifier)


def string(text: str) -> str:
    """A string literal."""
    return f'"{ascii_line(text)}"'


def matrix(rows: Iterable[Sequence[float]]) -> str:
    """A matrix literal, one row per line where there are several."""
    lines = [", ".join(number(value) for value in row) for row in rows]
    return "[" + ";\n      ".join(lines) + "]"
