# SPDX-License-Identifier: MIT
"""Lines of a card: an entry with the meaning of its number, its unit, and its origin."""

from __future__ import annotations

from collections.abc import Iterator

from drivetwin._util.toml import format_text
from drivetwin._util.visible_text import escape_line
from drivetwin.authoring.answers import Answer, Origin
from drivetwin.authoring.stated_number import StatedNumber


def format_entry(key: str, answer: Answer, meaning: str) -> Iterator[str]:
    """Write an entry below its meaning; an unknown one as a comment to fill in."""
    if meaning:
        yield f"# {meaning}"
    if answer.value is None:
        yield f"# {key} = ...{_format_note(answer)}"
    else:
        yield f"{key} = {format_value(answer.value)}{_format_note(answer)}"


def format_range(key: str, answer: Answer, meaning: str) -> Iterator[str]:
    """Write a range as [low, high]."""
    value = None if answer.value is None else list(answer.value)
    yield from format_entry(key, Answer(value, answer.origin, answer.note), meaning)


def format_value(value: object) -> str:
    """Write a value in TOML; a stated number in its own digits."""
    if isinstance(value, StatedNumber):
        return value.entry
    if isinstance(value, str):
        return format_text(value)
    if isinstance(value, list):
        return f"[{', '.join(map(format_value, value))}]"
    return repr(value)


def _format_note(answer: Answer) -> str:
    if answer.origin is Origin.GUESS:
        return f"  # guess: {escape_line(answer.note)}"
    return f"  # {escape_line(answer.note)}" if answer.note else ""
