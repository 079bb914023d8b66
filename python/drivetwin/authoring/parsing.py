# SPDX-License-Identifier: MIT
"""Conversion of typed answers to values; ValueError states why one is refused."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence

from drivetwin._util.toml import MAX_EXPONENT, is_extreme

Parser = Callable[[str], object]

MOST_CHARACTERS = 200
"""Longest name."""


def parse_number(text: str) -> float:
    """Parse a finite number with a decimal point, of a size that a card may have."""
    text = text.strip()
    try:
        value = float(text)
    except ValueError:
        if re.fullmatch(r"[+-]?\d+,\d+", text):
            raise ValueError(f"{text!r} is no number: write a point instead of the comma") from None
        raise ValueError(f"{text!r} is no number") from None
    if not math.isfinite(value) or "_" in text:
        raise ValueError(f"{text!r} is no finite number")
    if is_extreme(value):
        raise ValueError(f"{text!r} is beyond 1e{MAX_EXPONENT} or within 1e-{MAX_EXPONENT} of zero")
    return value


def parse_bounded(
    text: str, low: float = 0.0, high: float = 1e12, *, zero: bool = False, unit: str = ""
) -> float:
    """Parse a number above `low` (with `zero` from it on) and up to `high`."""
    value = parse_number(text)
    shown = f" {unit}" if unit else ""
    if value < low or (value == low and not zero):
        raise ValueError(f"{value:g}{shown} is not {'at least' if zero else 'above'} {low:g}")
    if value > high:
        raise ValueError(f"{value:g}{shown} is above {high:g}, the largest value that can be")
    return value


def parse_count(text: str, high: float) -> int:
    """Parse a whole number above zero and up to `high`."""
    value = parse_bounded(text, high=high)
    if value != int(value):
        raise ValueError(f"{value:g} is no whole number")
    return int(value)


def split_list(text: str) -> list[str]:
    """Split a list at semicolons, else at white space, else at commas."""
    if ";" in text:
        parts = text.split(";")
    else:
        parts = re.split(r"\s+", text.strip())
        parts = parts if len(parts) > 1 else text.split(",")
    return [part for one in parts if (part := one.strip().strip(",").strip())]


def parse_name(text: str) -> str:
    """Parse a name: any text of a line, without bytes that are no characters."""
    name = text.strip()
    if not name:
        raise ValueError("the name is empty")
    if len(name) > MOST_CHARACTERS:
        raise ValueError(f"the name has {len(name)} characters, at most {MOST_CHARACTERS} are used")
    if any(0xD800 <= ord(one) <= 0xDFFF for one in name):
        raise ValueError("the name contains bytes that are no text in UTF-8")
    return name


def parse_names(text: str, count: int | None = None) -> tuple[str, ...]:
    """Parse different names, as many as `count` states."""
    names = tuple(parse_name(part) for part in split_list(text))
    if count is not None and len(names) != count:
        raise ValueError(f"{len(names)} names for {count} gears: give one for each gear")
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ValueError(f"{twice!r} is named twice: each gear has its own")
    if not names:
        raise ValueError("no name is given")
    return names


def _split_pair(text: str, separators: str, example: str) -> list[float]:
    """Split one or two numbers; a comma between digits is refused, for it may be a decimal one."""
    if re.search(r"\d\s*,\s*\d", text):
        raise ValueError(f"{text.strip()!r} has a comma: write a decimal point, or {example}")
    texts = re.split(rf"\s*(?:{separators})\s*", text.strip())
    parts = [parse_bounded(part, zero=True) for part in texts]
    if len(parts) not in (1, 2):
        raise ValueError(f"give one number, or {example}")
    return parts


def parse_range(text: str, spread: float = 2.0) -> tuple[float, float]:
    """Parse LOW..HIGH; of one value the range from it over `spread` to it times `spread`."""
    parts = _split_pair(text, r"\.\.\.?|\bto\b|–", "LOW..HIGH for a range, as 4..20")
    low, high = parts if len(parts) == 2 else (parts[0] / spread, parts[0] * spread)
    if not 0.0 < low < high:
        raise ValueError(f"a range is LOW..HIGH with 0 below LOW below HIGH, not {low:g}..{high:g}")
    return low, high


def parse_choice(text: str, choices: Sequence[str]) -> str:
    """Parse one of the `choices`; an unambiguous beginning is enough."""
    wanted = text.strip().casefold()
    exact = [one for one in choices if one.casefold() == wanted]
    found = exact or [one for one in choices if wanted and one.casefold().startswith(wanted)]
    if len(found) != 1:
        raise ValueError(f"{text.strip()!r} is not one of {', '.join(choices)}")
    return found[0]
