# SPDX-License-Identifier: MIT
"""Tokens of the Modelica language: identifiers, numbers, strings, matrices."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from drivetwin.export.parameters.content import format_number
from drivetwin.export.parameters.spelling import make_distinct, to_ascii_line

_KEYWORDS = re.compile(
    "algorithm|and|annotation|assert|block|break|class|connect|connector|constant|constrainedby|"
    "der|discrete|each|else|elseif|elsewhen|encapsulated|end|enumeration|equation|expandable|"
    "extends|external|false|final|flow|for|function|if|import|impure|in|initial|inner|input|loop|"
    "model|not|operator|or|outer|output|package|parameter|partial|protected|public|pure|record|"
    "redeclare|replaceable|return|stream|then|time|true|type|when|while|within"
)


def make_identifier(name: str) -> str:
    """The name in letters, digits and `_`, no digit in front, and no keyword."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", to_ascii_line(name))
    return f"x_{plain}" if not re.match("[A-Za-z]", plain) or _KEYWORDS.fullmatch(plain) else plain


def make_identifiers(names: Iterable[str]) -> dict[str, str]:
    """An identifier for each name; those that would coincide are numbered."""
    return make_distinct(names, make_identifier)


def format_string(text: str) -> str:
    """A string literal."""
    return f'"{to_ascii_line(text)}"'


def format_matrix(rows: Iterable[Sequence[float]]) -> str:
    """A matrix literal, one row per line where there are several."""
    lines = [", ".join(format_number(value) for value in row) for row in rows]
    return "[" + ";\n      ".join(lines) + "]"
